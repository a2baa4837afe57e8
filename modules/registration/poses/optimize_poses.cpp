// SPDX-License-Identifier: MIT
module cilantro.registration;

import cilantro.numeric;
import :edge_kernel;
import :information;
import :pose_descent;
import :pose_equations;
import :twists;

namespace cilantro {
namespace {

/// Which nodes edges that count connect, and which of them stay where they are.
struct connected_nodes {
  index_list component_of;
  index_t components = 0;
  std::vector<bool> is_fixed;
  bool is_connected = true;  ///< Whether the edges say how all nodes lie to each other.
};

template <int D>
connected_nodes connect(index_t nodes, std::span<const pose_edge<D>> edges,
                        const std::vector<bool>& counts, const std::vector<index_t>& fixed) {
  disjoint_sets sets{nodes};
  for (std::size_t e = 0; e < edges.size(); ++e)
    if (counts[e]) sets.join(edges[e].source, edges[e].target);
  connected_nodes all;
  for (index_t i = 0; i < nodes; ++i) {
    const index_t lowest = sets.find(i);
    all.component_of.push_back(lowest == i ? std::int32_t(all.components++)
                                           : all.component_of[lowest]);
  }
  std::vector<bool> has_fixed(static_cast<std::size_t>(all.components));
  all.is_fixed.resize(static_cast<std::size_t>(nodes));
  for (const index_t node : fixed) all.is_fixed[node] = has_fixed[all.component_of[node]] = true;
  const auto without = std::ranges::count(has_fixed, false);
  all.is_connected = without == 0 || (fixed.empty() && without == 1);
  for (index_t i = 0; i < nodes; ++i)
    if (sets.find(i) == i && !has_fixed[all.component_of[i]]) all.is_fixed[i] = true;
  return all;
}

/// Moves each component so that its fixed node is where it was at the start. Only a node that
/// rejected edges have cut off is elsewhere.
template <int D>
void hold(std::vector<pose<D>>& poses, const std::vector<pose<D>>& start,
          const connected_nodes& nodes, const std::vector<bool>& was_fixed) {
  std::vector<pose<D>> moves(static_cast<std::size_t>(nodes.components), pose<D>::Identity());
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (nodes.is_fixed[i] && !was_fixed[i])
      moves[nodes.component_of[i]] = start[i] * poses[i].inverse();
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (const auto& move = moves[nodes.component_of[i]]; !move.matrix().isIdentity(0))
      poses[i] = normalized<D>(move * poses[i]);
}

void expect_options(const pose_graph_options& options, index_t nodes) {
  expect_from(0, options.max_iterations, "optimize_poses: max_iterations");
  expect_from(0, options.tolerance, "optimize_poses: the tolerance");
  expect_between(0, options.min_weight, 1, "optimize_poses: min_weight");
  for (const index_t node : options.fixed)
    expects(0 <= node && node < nodes, "optimize_poses: .fixed names node " + std::to_string(node) +
                                           ", and there are " + std::to_string(nodes));
}

}  // namespace

template <int D>
pose_graph_result<rigid_transform<double, D>> optimize_poses_closed(
    const std::vector<rigid_transform<double, D>>& nodes,
    const std::span<const pose_edge<D>>& edges, const pose_graph_options& options) {
  const index_t count = std::ssize(nodes);
  expect_options(options, count);
  auto start = nodes;
  for (index_t i = 0; i < count; ++i) {
    expects(is_rigid<D>(start[i]), "optimize_poses: the pose of node " + std::to_string(i) +
                                       " is not finite, or not a rotation and a translation");
    if (!(start[i].linear() * start[i].linear().transpose()).isIdentity(1e-14))
      start[i] = normalized<D>(start[i]);
  }
  std::vector<bool> speaks;
  for (index_t e = 0; e < std::ssize(edges); ++e)
    speaks.push_back(expect_edge<D>(edges[e], e, count).rank > 0);

  const edge_kernel kernel{options.robust, options.min_weight};
  auto connected = connect<D>(count, edges, speaks, options.fixed);
  pose_descent<D> descent{edges, kernel, options, connected.is_fixed};
  pose_graph_result<rigid_transform<double, D>> result;
  auto& poses = result.poses = start;
  const double at_start = result.cost_at_start = descent.cost(descent.chi_squares(start));
  bool is_cancelled = false, has_converged = false;
  try {
    if (options.robust) descent.graduate(poses);
    has_converged = descent.settle(poses);
    if (options.robust && descent.cost(descent.chi_squares(poses)) > at_start) {
      poses = start;
      has_converged = descent.settle(poses);
    }
  } catch (const cancelled&) {
    is_cancelled = true;
    if (descent.cost(descent.chi_squares(poses)) > at_start) poses = start;
  }

  auto chi_squares = descent.chi_squares(poses);
  const auto weights = descent.weights(chi_squares, 1);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto verdict = !speaks[e]        ? edge_verdict::silent
                         : weights[e] == 0 ? edge_verdict::rejected
                                           : edge_verdict::kept;
    speaks[e] = verdict == edge_verdict::kept;
    result.edges.push_back({edges[e].source, edges[e].target, chi_squares[e], weights[e], verdict});
  }
  result.chi_square_limit = kernel.end() * kernel.end();
  result.iterations = descent.iterations();
  const auto was_fixed = std::exchange(connected, connect<D>(count, edges, speaks, options.fixed));
  if (connected.components > was_fixed.components) {
    hold<D>(poses, start, connected, was_fixed.is_fixed);
    chi_squares = descent.chi_squares(poses);
    for (std::size_t e = 0; e < edges.size(); ++e) result.edges[e].chi_square = chi_squares[e];
  }
  result.cost = descent.cost(chi_squares);
  result.component_of = std::move(connected.component_of);
  result.components = connected.components;
  result.undetermined =
      pose_descent<D>{edges, kernel, options, connected.is_fixed}.undetermined(poses, weights);
  result.status = is_cancelled              ? pose_graph_status::cancelled
                  : !has_converged          ? pose_graph_status::iteration_limit
                  : !connected.is_connected ? pose_graph_status::disconnected
                  : result.undetermined > 0 ? pose_graph_status::degenerate
                                            : pose_graph_status::converged;
  if (options.monitor.progress && !is_cancelled) options.monitor.progress(1);
  return result;
}

template pose_graph_result<rigid_transform<double, 2>> optimize_poses_closed(
    const std::vector<rigid_transform<double, 2>>&, const std::span<const pose_edge<2>>&,
    const pose_graph_options&);
template pose_graph_result<rigid_transform<double, 3>> optimize_poses_closed(
    const std::vector<rigid_transform<double, 3>>&, const std::span<const pose_edge<3>>&,
    const pose_graph_options&);

}  // namespace cilantro
