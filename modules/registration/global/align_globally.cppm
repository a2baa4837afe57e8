// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
export module cilantro.registration:align_globally;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.cloud;
import :align;
import :concepts;
import :correspondence;
import :motion;
import :pair_graph;
import :putative_pairs;

namespace cilantro {

/// What a global registration knows about its result.
export enum class global_status {
  unique,  ///< One transform explains the data, and no other does nearly as well.
  /// Several transforms explain the data about as well, or what speaks for the best one is not
  /// enough to be sure: `alternatives` has the others.
  ambiguous,
  too_few,     ///< No transform is supported by more than chance explains; there is none.
  degenerate,  ///< One transform explains the data, which leave some of its directions
               ///< undetermined.
  cancelled,   ///< A stop was requested.
};
export [[nodiscard]] std::string_view to_string(global_status status);
export std::ostream& operator<<(std::ostream& out, global_status status);

/// A transform that a global registration has considered, and what speaks for it.
export template <class T>
struct global_candidate {
  T transform;          ///< From the source to the target.
  index_t inliers = 0;  ///< The pairs that agree with it.
  double overlap = 0;   ///< The share of the source's points that lie on the target.
  /// Of the points that the other set's viewpoint should see, the share that lies clearly before
  /// what it has seen. 0 if there is no viewpoint.
  double contradicted = 0;
  double score = 0;  ///< What candidates are compared by; larger is better.
};

/// The result of `align_globally`. The figures are those of the returned transform: of all points,
/// if there is a `voxel`, or of the pairs that agree.
export template <class T>
struct global_result : alignment_fit {
  T transform;  ///< From the source to the target; the identity if there is none.
  global_status status = global_status::too_few;  ///< What is known about it.
  index_t matches = 0;                            ///< The pairs that were considered.
  /// Those that agree with the transform. Their `distance` is that of their features, or 0 if pairs
  /// were given.
  correspondences<double> inliers;
  double contradicted = 0;                        ///< See `global_candidate`.
  double score = 0;                               ///< See `global_candidate`.
  std::vector<global_candidate<T>> alternatives;  ///< Other transforms, the best one first.

  /// Whether the status is `unique`.
  [[nodiscard]] bool is_unique() const { return status == global_status::unique; }
};
void print_figures(std::ostream& out, global_status status, index_t inliers, index_t matches,
                   std::size_t alternatives, const alignment_fit& fit);
/// Prints one line with the status and the figures, without the transform.
export template <class T>
std::ostream& operator<<(std::ostream& out, const global_result<T>& result) {
  print_figures(out, result.status, std::ssize(result.inliers), result.matches,
                result.alternatives.size(), result);
  return out;
}

/// Between which values a scale is searched.
export struct scale_range {
  double smallest, largest;  ///< Both are tried, too.
};

/// A `PairSolver` of any type, for both dimensions.
export class any_pair_solver {
 public:
  template <class S>
    requires(PairSolver<S, 2> || PairSolver<S, 3>)
  any_pair_solver(S solver) {  // NOLINT: a conversion on purpose
    if constexpr (PairSolver<S, 2>)
      flat_ = [solver](const auto& pairs, const auto& how) { return solver.propose(pairs, how); };
    if constexpr (PairSolver<S, 3>)
      solid_ = [solver](const auto& pairs, const auto& how) { return solver.propose(pairs, how); };
  }

  /// What the solver proposes. Throws `invalid_input` if it is not for this dimension.
  [[nodiscard]] std::vector<pair_proposal<2>> propose(const putative_pairs<2>& pairs,
                                                      const execution& how) const;
  [[nodiscard]] std::vector<pair_proposal<3>> propose(const putative_pairs<3>& pairs,
                                                      const execution& how) const;

 private:
  std::function<std::vector<pair_proposal<2>>(const putative_pairs<2>&, const execution&)> flat_;
  std::function<std::vector<pair_proposal<3>>(const putative_pairs<3>&, const execution&)> solid_;
};

/// Options of `align_globally`.
export struct global_options {
  /// The edge of the cells to which both sets are reduced, in the units of the points: the one
  /// scale, from which all others follow. Required, unless pairs are given.
  double voxel = 0;
  /// The points of a right pair are at most this far apart; by default, twice `voxel`.
  std::optional<double> max_distance = {};
  /// Neighbourhoods for estimating normals, where there are none; by default, of radius 2 `voxel`.
  std::optional<neighborhood_spec> normals = {};
  /// Neighbourhoods of features; by default, of radius 5 `voxel`.
  std::optional<neighborhood_spec> features = {};
  /// Whether the normals of both sets point to the side from which the surface was seen. Otherwise
  /// their signs are not used, unless there are viewpoints.
  bool oriented = false;
  /// Where each set was seen from, in its own coordinates, such as zeros for a scan in those of its
  /// sensor. Normals are turned towards it, and no point of the other set may lie clearly between
  /// it and what it has seen: this is what tells most wrong transforms. Without pairs, features are
  /// compared, so that there are both or none, unless `oriented` speaks for the other one.
  std::optional<coordinates> source_viewpoint = {}, target_viewpoint = {};
  /// The vertical in both sets, which the transform keeps, such as that of gravity; only its
  /// direction counts.
  std::optional<coordinates> up = {};
  /// For `align_globally<similarity_motion>` only: how much larger the target may be. Required
  /// there.
  std::optional<scale_range> scales = {};
  any_pair_solver solver = pair_graph<>{};  ///< What proposes transforms from the pairs.
  int threads = 0;
  /// If a stop is requested, `align_globally` returns with the status `cancelled`.
  task_monitor monitor = {};
};

/// Options of `describe_surface`: those of `global_options` that are about one set.
export struct surface_options {
  double voxel = 0;  ///< The edge of the cells to which the set is reduced. Required.
  /// Neighbourhoods for estimating normals, where there are none; by default, of radius 2 `voxel`.
  std::optional<neighborhood_spec> normals = {};
  /// Neighbourhoods of features; by default, of radius 5 `voxel`.
  std::optional<neighborhood_spec> features = {};
  bool oriented = false;  ///< Whether given normals point to where the surface was seen from.
  std::optional<coordinates> viewpoint = {};  ///< Where it was seen from, in its coordinates.
  int threads = 0;
  task_monitor monitor = {};
};

/// What the library is compiled for.
template <Scalar S, int D>
struct global_input {
  points_view<S, D> points, normals;
  std::optional<coordinates> anchor = {};  ///< Of voxels.
};
template <int C, PointsSource P>
[[nodiscard]] auto global_input_of(const P& points) {
  using S = scalar_of<P>;
  global_input<S, C> input{points_view<S, C>{points_in(points)},
                           points_view<S, C>{normals_in(points)}};
  if (const auto origin = origin_in(points); !origin.isZero(0))
    input.anchor = coordinates{(-origin).eval()};
  return input;
}

/// Voxels with normals and features, in two or three dimensions.
struct surface_description;
struct described_parts {
  std::shared_ptr<const surface_description> all;
  Eigen::VectorXd origin;
};
template <Scalar S, int D>
std::shared_ptr<const surface_description> closed_describe(const global_input<S, D>& input,
                                                           const surface_options& options);
[[nodiscard]] index_t voxels_of(const surface_description& surface);
[[nodiscard]] const Eigen::MatrixXf& features_of(const surface_description& surface);

/// What `align_globally` computes of one set: for sets that are aligned with several others.
/// Copies share it. Made by `describe_surface`.
export template <Scalar S, int D>
class described_surface {
 public:
  /// For `describe_surface`.
  explicit described_surface(described_parts parts) : parts_{std::move(parts)} {
    expects(parts_.all != nullptr, "described_surface: make it by describe_surface");
  }

  /// The number of voxels.
  [[nodiscard]] index_t size() const { return voxels_of(*parts_.all); }
  /// The square roots of their `fpfh`, one per column; of more than 10,000 voxels, of so many of
  /// them.
  [[nodiscard]] const Eigen::MatrixXf& features() const { return features_of(*parts_.all); }
  [[nodiscard]] const described_parts& parts() const { return parts_; }

 private:
  described_parts parts_;
};

/// The indices of given pairs.
struct pair_indices {
  index_list sources, targets;
};
/// Throws `invalid_input{what}` for indices that no point can have.
template <class R>
[[nodiscard]] pair_indices pair_indices_of(const R& pairs, const char* what) {
  pair_indices all;
  const auto take = [&](index_list& to, index_t index) {
    expects(0 <= index && index <= std::numeric_limits<std::int32_t>::max(), what);
    to.push_back(static_cast<std::int32_t>(index));
  };
  for (const auto& pair : pairs) {
    take(all.sources, pair.source);
    take(all.targets, pair.target);
  }
  return all;
}
/// A range of pairs with indices of points.
template <class R>
concept RangeOfPairs =
    std::ranges::input_range<R> && requires(const std::ranges::range_value_t<R>& pair) {
      { pair.source } -> std::convertible_to<index_t>;
      { pair.target } -> std::convertible_to<index_t>;
    };

/// Everything about a result that does not depend on the type of the transform.
struct found_globally : alignment_fit {
  struct candidate {
    Eigen::MatrixXd linear;
    Eigen::VectorXd translation;
    index_t inliers;
    double overlap, contradicted, score;
  };
  global_status status = global_status::too_few;
  index_t matches = 0;
  correspondences<double> inliers;
  std::vector<candidate> candidates;  ///< The best one first.
};
/// By features.
found_globally align_descriptions(const surface_description& source,
                                  const surface_description& target, const global_options& options);
/// By pairs; if there is a voxel, on all points.
template <Scalar S, int D>
found_globally closed_align_globally(const global_input<S, D>& source,
                                     const global_input<S, D>& target, const index_list& sources,
                                     const index_list& targets, const global_options& options);
/// What `f` returns; the status `cancelled` if it throws `cancelled`.
found_globally unless_cancelled(const std::function<found_globally()>& f);
/// The part of the options that is about one set.
[[nodiscard]] surface_options source_options(const global_options& options);
[[nodiscard]] surface_options target_options(const global_options& options);
/// Throws `invalid_input` unless scales are given where they are searched for.
void expect_scales(const global_options& options, bool are_searched);
/// Throws `invalid_input` for options that `describe_surface` has taken.
void expect_no_surface_options(const global_options& options);

template <class T>
[[nodiscard]] auto to_result(found_globally&& found, index_t dimension) {
  global_result<T> result;
  result.transform = identity_transform<T>(dimension);
  for (std::size_t i = 0; i < found.candidates.size(); ++i) {
    const auto& c = found.candidates[i];
    const global_candidate<T> next{make_transform<T>(c.linear, c.translation), c.inliers, c.overlap,
                                   c.contradicted, c.score};
    if (i == 0) {
      result.transform = next.transform;
      result.contradicted = next.contradicted;
      result.score = next.score;
    } else {
      result.alternatives.push_back(next);
    }
  }
  static_cast<alignment_fit&>(result) = std::move(static_cast<alignment_fit&>(found));
  result.status = found.status;
  result.matches = found.matches;
  result.inliers = std::move(found.inliers);
  return result;
}

/// As `align` does: relative to the target's origin on both sides.
template <class T>
[[nodiscard]] auto to_result(found_globally&& found, const Eigen::VectorXd& source_origin,
                             const Eigen::VectorXd& target_origin) {
  const bool has_transform = !found.candidates.empty();
  auto result =
      to_result<T>(std::move(found), std::max(source_origin.size(), target_origin.size()));
  if (source_origin.size() == target_origin.size() && has_transform) {
    const Eigen::VectorXd shift = source_origin - target_origin;
    result.transform = after_shift<T>(result.transform, -shift);
    for (auto& c : result.alternatives) c.transform = after_shift<T>(c.transform, -shift);
  }
  return result;
}

/// Finds the rigid transform that moves a source onto a target from anywhere: without a start, from
/// what the surfaces look like. Each is a cloud, points of any kind, or points with normals, in two
/// or three dimensions.
///
/// Both are reduced to voxels; `fpfh` features are matched; `options.solver` proposes transforms
/// from the matches; and those are refined and compared on all points. The status says what is
/// known: only `unique` results should be used unseen. `align` with `.initial = found.transform`
/// on the full clouds makes the result precise.
///
/// If clouds have origins, the transform is relative to the target's origin, as with `align`, and
/// viewpoints are world coordinates. Points that are not finite are ignored. The same result for
/// any number of threads, and every time. Throws `invalid_input` for options that make no sense,
/// and for points of different dimension; bad data does not throw. O(N k + N N' + M²) for N and N'
/// voxels and M matches, of which there are at most N; memory: 13 bytes per voxel and feature bin,
/// and M²/8. Source: features Rusu et al. 2009; pairs Chen et al. 2022, "SC²-PCR".
export template <MotionModel Model = rigid_motion, PointsSource A, PointsSource B>
  requires std::same_as<points_view_of<A>, points_view_of<B>> && std::same_as<Model, rigid_motion>
[[nodiscard]] auto align_globally(const A& source, const B& target, const global_options& options) {
  constexpr int C = closed_dimension<dimension_of<A>>;
  global_options how = options;
  how.monitor = in_passes(options.monitor, 3);
  return to_result<rigid_transform<scalar_of<A>, dimension_of<A>>>(
      unless_cancelled([&] {
        const auto moving = closed_describe(global_input_of<C>(source), source_options(how));
        const auto onto = closed_describe(global_input_of<C>(target), target_options(how));
        return align_descriptions(*moving, *onto, how);
      }),
      origin_in(source), origin_in(target));
}

/// What `align_globally` computes of one set, once for all sets that it is aligned with. Throws as
/// `align_globally` does; `cancelled`.
export template <PointsSource P>
[[nodiscard]] auto describe_surface(const P& points, const surface_options& options) {
  constexpr int D = dimension_of<P>;
  return described_surface<scalar_of<P>, D>{
      {closed_describe(global_input_of<closed_dimension<D>>(points), options), origin_in(points)}};
}

/// As above, between sets that have been described. Throws `invalid_input` if their voxels differ,
/// or if options are set that `describe_surface` takes.
export template <Scalar S, int D>
[[nodiscard]] auto align_globally(const described_surface<S, D>& source,
                                  const described_surface<S, D>& target,
                                  const global_options& options = {}) {
  expect_no_surface_options(options);
  return to_result<rigid_transform<S, D>>(
      align_descriptions(*source.parts().all, *target.parts().all, options), source.parts().origin,
      target.parts().origin);
}

/// As above, from pairs of your own, most of which may be wrong: any range of pairs with members
/// `source` and `target`, which are indices of points. If there is a `voxel`, transforms are
/// refined and compared on all points, too; otherwise by the pairs alone, and `max_distance` is
/// required. Throws `invalid_input` for an index that is not one of a point.
///
/// `align_globally<similarity_motion>(…)` finds a scale, too, between those of `options.scales`, by
/// trying as many as `max_distance` calls for; not with a `voxel`. Its result is an affine
/// transform.
export template <MotionModel Model = rigid_motion, PointsSource A, PointsSource B, RangeOfPairs R>
  requires std::same_as<points_view_of<A>, points_view_of<B>> &&
           (std::same_as<Model, rigid_motion> || std::same_as<Model, similarity_motion>)
[[nodiscard]] auto align_globally(const A& source, const B& target, const R& pairs,
                                  const global_options& options) {
  expect_scales(options, std::same_as<Model, similarity_motion>);
  const auto [sources, targets] =
      pair_indices_of(pairs, "align_globally: a pair has an index that is not one of a point");
  constexpr int C = closed_dimension<dimension_of<A>>;
  return to_result<transform_of<Model, scalar_of<A>, dimension_of<A>>>(
      closed_align_globally(global_input_of<C>(source), global_input_of<C>(target), sources,
                            targets, options),
      origin_in(source), origin_in(target));
}

template <class Model, class A, class B>
void refuse_to_align_globally() {
  static_assert(std::same_as<A, B>,
                "align_globally: source and target must have the same scalar and dimension; cast "
                "one of them, as by cast<double>(cloud)");
  static_assert(!std::same_as<A, B> || !MotionModel<Model>,
                "align_globally: finds rigid transforms, or similarities from pairs; for any other "
                "motion, start `align` from one: align<affine_motion>(source, target, {.initial = "
                "found.transform})");
}
/// Refused by the compiler with a sentence: sets of different scalar or dimension, and other
/// motions.
export template <MotionModel Model = rigid_motion, PointsSource A, PointsSource B>
  requires(!std::same_as<points_view_of<A>, points_view_of<B>> ||
           !std::same_as<Model, rigid_motion>)
void align_globally(const A&, const B&, const global_options&) {
  refuse_to_align_globally<Model, points_view_of<A>, points_view_of<B>>();
}
export template <MotionModel Model = rigid_motion, PointsSource A, PointsSource B, RangeOfPairs R>
  requires(!std::same_as<points_view_of<A>, points_view_of<B>> ||
           !(std::same_as<Model, rigid_motion> || std::same_as<Model, similarity_motion>))
void align_globally(const A&, const B&, const R&, const global_options&) {
  refuse_to_align_globally<Model, points_view_of<A>, points_view_of<B>>();
}
export template <Scalar S, int D, Scalar Other, int E>
  requires(!std::same_as<points_view<S, D>, points_view<Other, E>>)
void align_globally(const described_surface<S, D>&, const described_surface<Other, E>&,
                    const global_options& = {}) {
  refuse_to_align_globally<rigid_motion, points_view<S, D>, points_view<Other, E>>();
}

#define CILANTRO_COMPILED_ELSEWHERE(S, D)                                                         \
  extern template std::shared_ptr<const surface_description> closed_describe(                     \
      const global_input<S, D>&, const surface_options&);                                         \
  extern template found_globally closed_align_globally(                                           \
      const global_input<S, D>&, const global_input<S, D>&, const index_list&, const index_list&, \
      const global_options&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
