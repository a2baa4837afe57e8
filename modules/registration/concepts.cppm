// SPDX-License-Identifier: MIT
export module cilantro.registration:concepts;

import cilantro.standard;
import cilantro.core;
import :correspondence;

namespace cilantro {

/// How far one transform is from another.
export struct transform_change {
  double rotation = 0;  ///< In radians; for a linear part A that is not a rotation, ‖A − I‖ / √2.
  double translation = 0;  ///< How far the centre of the pairs moves, in the units of the points.
  /// How large an apparent movement the rounding of the transform can cause, in the same units.
  double rounding = 0;
};

/// How well a source lies on a target under a transform, and how well the pairs determine that
/// transform.
export struct alignment_fit {
  /// The number of pairs, of all searches together if each term of a metric has its own.
  index_t pairs = 0;
  /// The share of the finite source points that have a partner.
  double overlap = 0;
  /// Root mean square of the distances between the points of the pairs, unweighted.
  double rmse = 0;
  /// Root of the weighted mean square of the metric's residuals, which is what is minimised.
  double residual = 0;
  /// The number of points of source and target with a coordinate that is not finite. They are in no
  /// pair.
  index_t non_finite = 0;

  /// The number of unknowns of the transform.
  index_t unknowns = 0;
  /// Σ w JᵀJ, with one row and column per unknown. If the weights are inverse variances, it is the
  /// inverse of the covariance of the transform. The unknowns are those of the motion model, around
  /// the origin of the target's coordinates: for a rigid motion in 3D, the rotation in radians
  /// about x, y and z, then the translation. Empty if there are too many unknowns for a dense
  /// matrix, as for a field of transforms; `directions` and `eigenvalues` are then empty, too.
  Eigen::MatrixXd information = {};
  /// Independent small motions, one per column, in the same unknowns, by ascending eigenvalue. Each
  /// moves the paired source points by one unit, root mean square; a motion that moves none of them
  /// is scaled to unit length.
  Eigen::MatrixXd directions = {};
  /// For each direction, the share, from 0 to 1, of the mean squared displacement of the points
  /// that the residuals notice. 1: all of it, as with `point_to_point`. 0: nothing, as with
  /// `point_to_plane` when a plane slides along itself.
  Eigen::VectorXd eigenvalues = {};
  /// How many of the directions, counted from the first, the pairs do not determine; no step is
  /// taken along these. If there are no directions, how many of the unknowns.
  index_t undetermined = 0;

  /// The directions that the pairs do not determine, one per column; no columns if all are
  /// determined.
  [[nodiscard]] Eigen::MatrixXd unobservable_directions() const {
    return directions.leftCols(std::min(undetermined, index_t(directions.cols())));
  }
  /// The share of the unknowns that the pairs do not determine, from 0 to 1.
  [[nodiscard]] double undetermined_share() const {
    return unknowns > 0 ? double(undetermined) / double(unknowns) : undetermined > 0 ? 1 : 0;
  }
};

/// One improvement of a transform.
export template <class T>
struct registration_step {
  T transform;  ///< The new transform; the old one if the pairs determine nothing.
  /// From the old to the new one: `icp` has converged when it is small, as it is if left out.
  transform_change change = {};
  alignment_fit fit = {};  ///< The fit of the old transform, with the given pairs.
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

/// The type of the pairs that a searcher finds for transforms of type T: `correspondences`, unless
/// the searcher has a member `template <class S> using pairs_type`.
export template <class Searcher, class T>
using pairs_of = typename pairs_of_searcher<Searcher, typename T::Scalar>::type;

/// Finds pairs of source and target points, after the source has been moved by a transform, which
/// is any `PointMap`.
///
/// Semantics: `find(transform, pairs)` clears `pairs` and writes the pairs that it finds, by
/// ascending source, then target; finding none is not an error. It depends on nothing but its
/// arguments, is const, and may be called by several registrations at once. Points that are not
/// finite are in no pair. Optional: a default-constructible type `memory`, and `find(transform,
/// memory, pairs)`, which gives the same result, faster, with the help of what earlier calls have
/// left in `memory`.
/// Models: `nearest_neighbor_searcher`, `feature_searcher`, `projective_searcher`,
/// `known_pairs_searcher`, `combined_searcher`; `check_correspondence_searcher` tests yours.
export template <class S, class T>
concept CorrespondenceSearcher =
    requires(const S& searcher, const T& transform, pairs_of<S, T>& pairs) {
      { searcher.find(transform, pairs) } -> std::same_as<void>;
    };

/// For a searcher or an estimator that remembers nothing.
struct no_memory {};
template <class S>
struct memory_of {
  using type = no_memory;
};
template <class S>
  requires requires { typename S::memory; }
struct memory_of<S> {
  using type = typename S::memory;
};

/// What a searcher or an estimator remembers from one call to the next; an empty type if it
/// remembers nothing.
template <class S>
using repeated_memory = typename memory_of<S>::type;

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
/// Semantics: `estimate(current, pairs)` returns the improved transform, its change from `current`,
/// and the fit of `current`. Whatever the pairs do not determine stays as it is in `current`, and
/// is counted in `fit.undetermined`. It depends on nothing but its arguments, and is const. The
/// transform may be any `PointMap`, even a field of many transforms: `pair_matcher` and
/// `weighted_rows` evaluate the library's metrics for those. Optional: a default-constructible type
/// `memory`, and `estimate(current, pairs, memory)`, which gives the same result, faster, with the
/// help of what earlier calls have left in `memory`.
/// Models: `point_to_point_estimator`, `least_squares_estimator`; `warp_estimator` of
/// `cilantro.warp`; `check_transform_estimator` tests yours.
export template <class E, class Pairs>
concept TransformEstimator = requires {
  typename E::transform_type;
  typename E::transform_type::Scalar;
} && requires(const E& estimator, const typename E::transform_type& current, const Pairs& pairs) {
  {
    estimator.estimate(current, pairs)
  } -> std::same_as<registration_step<typename E::transform_type>>;
};

/// One of many estimates with the same memory.
template <class E, class Pairs>
  requires TransformEstimator<E, Pairs>
[[nodiscard]] auto estimate_with_memory(const E& estimator,
                                        const typename E::transform_type& current,
                                        const Pairs& pairs, repeated_memory<E>& memory) {
  if constexpr (std::same_as<repeated_memory<E>, no_memory>)
    return estimator.estimate(current, pairs);
  else
    return estimator.estimate(current, pairs, memory);
}

}  // namespace cilantro
