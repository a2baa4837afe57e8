// SPDX-License-Identifier: MIT
module cilantro.embedding;

import cilantro.numeric;

namespace cilantro {
namespace {

/// The component of each node, numbered in the order of their first nodes; −1 for nodes without any
/// neighbour, not even themselves, which are no points.
template <Scalar S>
std::vector<index_t> components_in(const neighborhoods<S>& graph, index_t& count) {
  disjoint_sets sets{graph.size()};
  for (index_t i = 0; i < graph.size(); ++i)
    for (const auto& [j, distance] : graph[i]) sets.join(i, j);
  std::vector<index_t> component(static_cast<std::size_t>(graph.size()), -1);
  count = 0;
  for (index_t i = 0; i < graph.size(); ++i) {
    if (graph[i].empty()) continue;
    // A root comes first in its set.
    const index_t root = sets.find(i);
    component[i] = root == i ? count++ : component[root];
  }
  return component;
}

}  // namespace

template <Scalar S>
isomap_result isomap(const neighborhoods<S>& graph, const embedding_options& options) {
  expects(graph.size() <= most_isomap_points,
          "isomap: there are too many nodes for a matrix of all distances; take a sample");
  const auto both_ways = neighbor_graph(graph, {.self = true, .threads = options.threads});
  isomap_result result;
  const auto component = components_in(both_ways, result.components);
  std::vector<index_t> sizes(result.components);
  for (const index_t c : component)
    if (c >= 0) ++sizes[c];
  index_t largest = 0;
  for (index_t c = 1; c < result.components; ++c)
    if (sizes[c] > sizes[largest]) largest = c;
  for (index_t i = 0; i < graph.size(); ++i)
    if (component[i] == largest) result.kept.push_back(static_cast<std::int32_t>(i));
  if (result.kept.empty()) return result;

  Eigen::MatrixXd lengths = shortest_paths(both_ways, {options.threads, options.monitor});
  const auto n = std::ssize(result.kept);
  if (n < graph.size()) {
    Eigen::MatrixXd within(n, n);
    for (index_t j = 0; j < n; ++j)
      for (index_t i = 0; i < n; ++i) within(i, j) = lengths(result.kept[i], result.kept[j]);
    lengths = std::move(within);
  }
  // There and back are the same sums in another order.
  for (index_t j = 0; j < n; ++j)
    for (index_t i = 0; i < j; ++i) lengths(i, j) = lengths(j, i);
  static_cast<embedding_result&>(result) = multidimensional_scaling(std::move(lengths), options);
  return result;
}
template isomap_result isomap(const neighborhoods<float>&, const embedding_options&);
template isomap_result isomap(const neighborhoods<double>&, const embedding_options&);

}  // namespace cilantro
