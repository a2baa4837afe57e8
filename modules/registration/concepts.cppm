// SPDX-License-Identifier: MIT
export module cilantro.registration:concepts;

import cilantro.standard;
import cilantro.core;
import :correspondence;

namespace cilantro {

/// How far one transform is from another.
export struct transform_change {
  double rotation = 0;     ///< In radians; of a linear part that is no rotation, ‖A − I‖ / √2.
  double translation = 0;  ///< How far the centre of the pairs moves, in the units of the points.
  /// How far it may seem to move since the transform is rounded, in the same units.
  double rounding = 0;
};

/// How well a source lies on a target under some transform, and what the pairs say about it.
export struct alignment_fit {
  index_t pairs = 0;  ///< Of all searches together, if each term of a metric has its own.
  /// The share of the finite source points that have a partner.
  double overlap = 0;
  /// Root mean square of the distances between the points of the pairs, unweighted.
  double rmse = 0;
  /// Root of the weighted mean square of the metric's residuals: what is minimised.
  double residual = 0;
  /// Points of source and target that have a coordinate which is not finite. They are in no pair.
  index_t non_finite = 0;

  /// How many unknowns the transform has.
  index_t unknowns = 0;
  /// Σ w JᵀJ, one row and column an unknown; of no size where there are too many for a dense
  /// matrix, as of a field of transforms, which then has no directions and eigenvalues either. The
  /// inverse of the covariance of the transform if the weights are inverse variances. The unknowns
  /// are those of the motion model, around the origin of the target's coordinates: for a rigid
  /// motion in 3D the rotation in radians about x, y and z, then the translation.
  Eigen::MatrixXd information;
  /// Independent small motions, one a column in the same unknowns, by ascending eigenvalue. Each
  /// moves the paired source points by one unit, root mean square; one that moves none of them has
  /// unit length.
  Eigen::MatrixXd directions;
  /// Of each direction: the share, from 0 to 1, of the mean squared displacement of the points that
  /// the residuals see. 1: as pairs of points would. 0: nothing, like a plane that slides in
  /// itself.
  Eigen::VectorXd eigenvalues;
  /// How many of them, the first ones, the pairs do not determine. No step goes along these.
  /// Without directions: how many of the unknowns.
  index_t undetermined = 0;

  /// The directions that are not determined: unit motions, one a column; none is good news.
  [[nodiscard]] Eigen::MatrixXd unobservable_directions() const {
    return directions.leftCols(std::min(undetermined, index_t(directions.cols())));
  }
  /// The share of the unknowns that is not determined, from 0 to 1.
  [[nodiscard]] double undetermined_share() const {
    return unknowns > 0 ? double(undetermined) / double(unknowns) : undetermined > 0 ? 1 : 0;
  }
};

/// One improvement of a transform.
export template <class T>
struct registration_step {
  T transform;              ///< The new transform; the old one if the pairs say nothing.
  transform_change change;  ///< From the old to the new one.
  alignment_fit fit;        ///< Of the old transform, with the pairs that were given.
};

template <class T, class S>
struct pairs_of_searcher {
  using type = correspondences<S>;
};
template <class T, class S>
  requires requires { typename T::template pairs_type<S>; }
struct pairs_of_searcher<T, S> {
  using type = typename T::template pairs_type<S>;
};

/// What a searcher writes for transforms of type T: `correspondences`, unless it says otherwise by
/// a member `template <class S> using pairs_type`.
export template <class Searcher, class T>
using pairs_of = typename pairs_of_searcher<Searcher, typename T::Scalar>::type;

/// Pairs the source with the target, once the source has been moved by a transform: any `PointMap`.
///
/// Semantics: `find(transform, pairs)` clears `pairs` and writes what it finds by ascending source,
/// then target; no pair at all is no error. It depends on nothing but its arguments, is const, and
/// may serve several registrations at once. Points that are not finite are in no pair. Optional: a
/// type `memory`, default-constructible, and `find(transform, memory, pairs)` with the same result,
/// which may use what an earlier call has left in `memory` to be faster.
/// Models: `nearest_neighbor_searcher`, `feature_searcher`, `projective_searcher`,
/// `known_pairs_searcher`, `combined_searcher`; `check_correspondence_searcher` tests yours.
export template <class S, class T>
concept CorrespondenceSearcher =
    requires(const S& searcher, const T& transform, pairs_of<S, T>& pairs) {
      { searcher.find(transform, pairs) } -> std::same_as<void>;
    };

/// For a searcher that remembers nothing.
struct no_memory {};
template <class S>
struct memory_of_searcher {
  using type = no_memory;
};
template <class S>
  requires requires { typename S::memory; }
struct memory_of_searcher<S> {
  using type = typename S::memory;
};

/// What a searcher may remember from one call to the next; an empty type if it does not.
template <class S>
using repeated_memory = typename memory_of_searcher<S>::type;

/// One of many searches with the same memory.
template <class S, class T>
  requires CorrespondenceSearcher<S, T>
void find_with_memory(const S& searcher, const T& transform, repeated_memory<S>& memory,
                      pairs_of<S, T>& pairs) {
  if constexpr (std::same_as<repeated_memory<S>, no_memory>)
    searcher.find(transform, pairs);
  else
    searcher.find(transform, memory, pairs);
}

/// Improves a transform from pairs.
///
/// Semantics: `estimate(current, pairs)` returns the better transform, how far it is from
/// `current`, and the fit of `current`. What the pairs do not determine stays as it is in
/// `current`, and is counted in `fit.undetermined`; never is an answer made up. It depends on
/// nothing but its arguments and is const. The transform may be any `PointMap`, also a field of
/// many transforms: `pair_matcher` and `weighted_rows` give the shipped metrics under those.
/// Models: `point_to_point_estimator`, `least_squares_estimator`; `check_transform_estimator` tests
/// yours.
export template <class E, class Pairs>
concept TransformEstimator = requires {
  typename E::transform_type;
  typename E::transform_type::Scalar;
} && requires(const E& estimator, const typename E::transform_type& current, const Pairs& pairs) {
  {
    estimator.estimate(current, pairs)
  } -> std::same_as<registration_step<typename E::transform_type>>;
};

}  // namespace cilantro
