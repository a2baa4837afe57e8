// SPDX-License-Identifier: MIT
export module cilantro.registration:optimize_poses;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :pose_edge;

namespace cilantro {

/// Why the optimisation of a pose graph ended.
export enum class pose_graph_status {
  converged,        ///< The poses no longer change, and the edges determine all of them.
  iteration_limit,  ///< The poses were still changing after the last iteration.
  /// The poses no longer change, but nothing connects some of the nodes with the others: how the
  /// components of the graph lie to each other is as it was at the start.
  disconnected,
  /// The poses no longer change, but there are directions that no edge determines; along these,
  /// they are as they were at the start.
  degenerate,
  cancelled,  ///< A stop was requested.
};
export [[nodiscard]] std::string_view to_string(pose_graph_status status);
export std::ostream& operator<<(std::ostream& out, pose_graph_status status);

/// What became of an edge.
export enum class edge_verdict {
  kept,      ///< It took part.
  rejected,  ///< It contradicts the others, by a chi-square above the limit, and took no part.
  silent,    ///< Its information is 0, so that it says nothing.
};
export [[nodiscard]] std::string_view to_string(edge_verdict verdict);
export std::ostream& operator<<(std::ostream& out, edge_verdict verdict);

/// An edge in the result.
export struct pose_edge_report {
  index_t source, target;  ///< As in the edge.
  /// rᵀ · information · r, where r is the motion, in the unknowns of the information, that the
  /// edge's transform needs to agree with the poses. If edges deviate as their information says, it
  /// is the number of measured directions in the mean.
  double chi_square = 0;
  double weight = 1;  ///< That the robust kernel gives it; 0 if it is rejected.
  edge_verdict verdict = edge_verdict::kept;  ///< What became of it.
};

/// Options of `optimize_poses`.
export struct pose_graph_options {
  /// Nodes that stay where they are. In each component without one, its lowest node stays.
  std::vector<index_t> fixed = {};
  /// A robust weight of edges that are not trusted, as a function of the root of their chi-square:
  /// `huber{3}`, `geman_mcclure{3}`. Without one, all edges count fully, and none is rejected. Must
  /// not increase.
  robust_kernel robust = {};
  /// An edge whose weight would be smaller than this takes no part.
  double min_weight = 0.1;
  int max_iterations = 200;  ///< Those with a wider kernel included.
  /// The poses have converged when an iteration changes none by more than this, in radians and in
  /// the units of the points; or when rounding hides any progress.
  double tolerance = 1e-8;
  int threads = 0;
  /// If a stop is requested, the result has the status `cancelled`, instead of a throw.
  task_monitor monitor = {};
};

/// The figures of an optimised pose graph.
export struct pose_graph_figures {
  pose_graph_status status = pose_graph_status::converged;  ///< Why it ended.
  int iterations = 0;                                       ///< The number of iterations.
  double cost_at_start = 0;             ///< As `cost`, of the poses at the start.
  double cost = 0;                      ///< The sum of chi-squares, each as far as its kernel goes.
  std::vector<pose_edge_report> edges;  ///< One for each edge, in their order.
  /// With a robust kernel, the largest chi-square of an edge that is kept and not trusted.
  double chi_square_limit = std::numeric_limits<double>::infinity();
  /// The component of each node, numbered from 0 by their lowest nodes. Edges that say nothing or
  /// are rejected connect nothing.
  index_list component_of;
  index_t components = 0;    ///< How many there are.
  index_t undetermined = 0;  ///< How many independent directions no edge determines.

  /// Whether the status is `converged`.
  [[nodiscard]] bool converged() const { return status == pose_graph_status::converged; }
  /// The numbers of the edges that were rejected, ascending.
  [[nodiscard]] std::vector<index_t> rejected() const;
};
/// Prints a line with the figures, and one for each edge that was rejected.
export std::ostream& operator<<(std::ostream& out, const pose_graph_figures& figures);

/// The result of `optimize_poses`.
export template <class T>
struct pose_graph_result : pose_graph_figures {
  std::vector<T> poses;  ///< From the coordinates of each node to the world.
};

/// In double; see `optimize_poses`.
template <int D>
[[nodiscard]] pose_graph_result<rigid_transform<double, D>> optimize_poses_closed(
    const std::vector<rigid_transform<double, D>>& nodes,
    const std::span<const pose_edge<D>>& edges, const pose_graph_options& options);

extern template pose_graph_result<rigid_transform<double, 2>> optimize_poses_closed(
    const std::vector<rigid_transform<double, 2>>&, const std::span<const pose_edge<2>>&,
    const pose_graph_options&);
extern template pose_graph_result<rigid_transform<double, 3>> optimize_poses_closed(
    const std::vector<rigid_transform<double, 3>>&, const std::span<const pose_edge<3>>&,
    const pose_graph_options&);

/// Finds the poses of many scans that agree best with what alignments say of pairs of them, in 2D
/// or 3D. `nodes` are the poses to start from, each from the coordinates of its node to the world,
/// as Eigen's `Isometry`; see `pose_edge` for `edges`.
///
/// Minimises Σ rᵀ · information · r, where r is the logarithm of target⁻¹ · source · transform⁻¹: a
/// small motion in the unknowns of the information. Directions in which an edge has no information
/// cost nothing; what no edge determines stays as it was at the start. An edge and its `reversed`
/// one have the same cost.
///
/// With a robust kernel, its scale falls from where all edges count to its own (graduated
/// non-convexity), and edges that then contradict the others are rejected. The cost of the result
/// is never above that of the start. All in double; the same bits for any number of threads. Throws
/// `invalid_input` for numbers of nodes that there are not, transforms that are not rigid, matrices
/// that are not symmetric and positive semidefinite, and options that make no sense. About
/// O(iterations · (edges + nodes^1.5)).
/// Sources: Grisetti et al. 2010, "A tutorial on graph-based SLAM"; Yang et al. 2020, "Graduated
/// non-convexity for robust spatial perception", for the schedule.
export template <RigidMap T>
  requires(T::Dim == 2 || T::Dim == 3)
[[nodiscard]] pose_graph_result<T> optimize_poses(
    const std::vector<T>& nodes, std::type_identity_t<std::span<const pose_edge<T::Dim>>> edges,
    const pose_graph_options& options = {}) {
  using pose = rigid_transform<double, T::Dim>;
  std::vector<pose> start;
  start.reserve(nodes.size());
  for (const T& node : nodes)
    start.push_back(make_transform<pose>(node.linear(), node.translation()));
  auto found = optimize_poses_closed<T::Dim>(start, edges, options);
  if constexpr (std::same_as<T, pose>) {
    return found;
  } else {
    pose_graph_result<T> result{std::move(static_cast<pose_graph_figures&>(found)), {}};
    for (const pose& p : found.poses)
      result.poses.push_back(make_transform<T>(p.linear(), p.translation()));
    return result;
  }
}

/// The same from the start of `poses_from_edges`, for so many nodes.
export template <int D>
[[nodiscard]] pose_graph_result<rigid_transform<double, D>> optimize_poses(
    index_t nodes, const std::vector<pose_edge<D>>& edges, const pose_graph_options& options = {}) {
  return optimize_poses_closed<D>(poses_from_edges(nodes, edges), edges, options);
}

}  // namespace cilantro
