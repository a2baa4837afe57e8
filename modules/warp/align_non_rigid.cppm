// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
export module cilantro.warp:align_non_rigid;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.registration;
import :deformation_graph;
import :warp_engine;
import :warp_field;

namespace cilantro {

/// One iteration of `align_non_rigid`, as it is passed to an observer.
export struct non_rigid_iteration {
  int number;                ///< Counted from 1.
  double kernel_scale;       ///< Of the robust kernel, in the units of the points.
  double stiffness;          ///< As in `warp_options`.
  index_t points, nodes;     ///< How many take part.
  transform_change change;   ///< How far the iteration moved the points.
  const alignment_fit& fit;  ///< Of the field before the iteration.
};

/// Options of `align_non_rigid`.
export struct non_rigid_options {
  /// The distance between nodes, in the units of the points: what is smaller is moved rigidly (or
  /// by the motion model). Required.
  double spacing = 0;
  /// Points farther apart than this are never paired: as far as parts have moved. Without a limit,
  /// all are paired at first.
  double max_distance = std::numeric_limits<double>::infinity();
  /// How much linked nodes are kept alike in the end, as in `warp_options`; larger at first.
  double stiffness = 0.05;
  /// What counts as far in the end, in the units of the points: pairs this far apart have less than
  /// half of the weight. 0: an eighth of the spacing.
  double kernel_scale = 0;
  /// How much the distance between the points of a pair counts, beside that along the normal.
  double point_weight = 0.02;
  robust_kernel smoothness = {};  ///< Of the disagreement of linked nodes, as in `warp_options`.
  /// How much motions that may deform are held to rotations, as in `warp_options`: 0.01 if not
  /// given. Without it, thin parts may collapse. Must be 0 or not given for rigid motions.
  std::optional<double> rigidity = {};
  index_t anchors = 4;                  ///< As in `deformation_graph_options`.
  neighborhood_spec links = knn{8};     ///< As in `deformation_graph_options`.
  neighborhood_spec normals = knn{10};  ///< For normals of a target that has none.
  /// Source points (`first`) and the target points (`second`) that are known to be the same places.
  /// They are pairs of the result, too, and no kernel asks how far they are apart.
  std::vector<std::pair<index_t, index_t>> landmarks = {};
  double landmark_weight = 1;  ///< Of all landmarks together, relative to all source points.
  /// With each kernel scale but the last. Many would let what is far pull its surroundings along.
  int max_iterations = 6;
  int final_iterations = 30;  ///< With the last kernel scale, unless it has converged before.
  /// The field has converged when no paired point and no node moves farther in an iteration, in the
  /// units of the points. 0: a twentieth of the spacing.
  double tolerance = 0;
  std::function<void(const non_rigid_iteration&)> observer = {};  ///< Called after each iteration.
  int threads = 0;
  /// If a stop is requested, the result has the status `cancelled`, instead of a throw.
  task_monitor monitor = {};
};

/// The result of `align_non_rigid`; `transform` is a field of all source points, to the target. The
/// figures are those of the points that took part in the last level, at most one of each cell with
/// an eighth of the spacing. After a stop, they are those before the last iteration, and `energy`
/// and `unsupported_nodes` are not known.
export template <Scalar S, int D, MotionModel Motion = rigid_motion>
struct non_rigid_result : icp_result<warp_field<S, D, Motion>> {
  /// What the field minimises, in squared units of the points: the weighted mean of the squared
  /// residuals, and the stiffness times the mean squared disagreement of linked nodes.
  double energy = 0;
  /// The nodes that no pair reaches. They follow the nodes that they are linked to, or stay.
  index_list unsupported_nodes;
};

/// A result in a dimension that the library is compiled for.
template <Scalar S, int D>
struct closed_non_rigid_result : alignment_fit {
  std::shared_ptr<const deformation_graph_data<S, D>> graph;
  node_motions<D> motions;
  icp_status status = icp_status::iteration_limit;
  int iterations = 0;
  transform_change last_change;
  double energy = 0;
  index_list unsupported_nodes;
};
template <MotionModel Motion, Scalar S, int D>
[[nodiscard]] closed_non_rigid_result<S, D> align_non_rigid_closed(
    const oriented_points_view<S, D>& source, const oriented_points_view<S, D>& target,
    const non_rigid_options& options);

/// Bends a source onto a target: finds a motion for each of many nodes, so that the points that
/// they move together lie on the target, and linked nodes move alike.
///
/// From coarse to fine: the robust kernel that tells what is near from what is far shrinks from a
/// third of `max_distance` to `kernel_scale`, and with its square the stiffness to `stiffness`;
/// fewer points and nodes take part as long as they suffice. Minimises the distance along the
/// normals of the target, which are estimated if it has none, and `point_weight` times that of the
/// points. The result has the status `converged` if the last iteration moved no point farther than
/// the tolerance; nodes that no pair reaches are listed, and are no failure. `align_non_rigid<
/// affine_motion>(…)` lets nodes stretch and shear, too. Source and target are clouds or points of
/// any kind with the same origin; points that are not finite take no part, and stay. The same bits
/// for any number of threads. Throws `invalid_input` for options that make no sense, for landmarks
/// that are not finite points of the sets, and for sets of different dimension or origin. A source
/// that lies elsewhere as a whole is aligned first, by `align`.
/// Sources: Sumner, Schmid & Pauly 2007, "Embedded deformation for shape manipulation"; Li, Sumner
/// & Pauly 2008, "Global correspondence optimization for non-rigid registration of depth scans",
/// for stiffness that falls.
export template <MotionModel Motion = rigid_motion, PointsSource A, PointsSource B>
  requires std::same_as<points_view_of<A>, points_view_of<B>>
[[nodiscard]] auto align_non_rigid(const A& source, const B& target,
                                   const non_rigid_options& options)
    -> non_rigid_result<scalar_of<A>, dimension_of<A>, Motion> {
  using S = scalar_of<A>;
  constexpr int D = dimension_of<A>, C = closed_dimension<D>;
  expect_same_origin(source, target, "align_non_rigid");
  auto found = align_non_rigid_closed<Motion, S, C>(detail::oriented<S, C>(source),
                                                    detail::oriented<S, C>(target), options);
  non_rigid_result<S, D, Motion> result;
  static_cast<alignment_fit&>(result) = std::move(static_cast<alignment_fit&>(found));
  result.transform = warp_field<S, D, Motion>{deformation_graph<S, D>{std::move(found.graph)}};
  result.transform.motions() = std::move(found.motions);
  result.status = found.status;
  result.iterations = found.iterations;
  result.last_change = found.last_change;
  result.energy = found.energy;
  result.unsupported_nodes = std::move(found.unsupported_nodes);
  return result;
}

/// Refused by the compiler with a sentence: source and target must have the same scalar and
/// dimension.
export template <class Motion = rigid_motion, PointsSource A, PointsSource B>
  requires(!std::same_as<points_view_of<A>, points_view_of<B>>)
void align_non_rigid(const A&, const B&, const non_rigid_options&) {
  static_assert(std::same_as<points_view_of<A>, points_view_of<B>>,
                "align_non_rigid: source and target must have the same scalar and dimension; cast "
                "one of them, as by cast<double>(cloud)");
}

#define CILANTRO_COMPILED_ELSEWHERE(S, D)                                              \
  extern template closed_non_rigid_result<S, D> align_non_rigid_closed<rigid_motion>(  \
      const oriented_points_view<S, D>&, const oriented_points_view<S, D>&,            \
      const non_rigid_options&);                                                       \
  extern template closed_non_rigid_result<S, D> align_non_rigid_closed<affine_motion>( \
      const oriented_points_view<S, D>&, const oriented_points_view<S, D>&,            \
      const non_rigid_options&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
