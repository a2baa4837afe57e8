// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <queue>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/closed_spaces.hpp"
module cilantro.registration;

namespace cilantro {
namespace {

using node_pairs = std::vector<std::pair<std::int32_t, std::int32_t>>;

/// Nodes with their distances, ascending; one more than the anchors, if there are so many.
struct near_nodes {
  std::vector<std::int32_t> nodes;
  std::vector<double> distances;
};

/// The weights of the first `count` nodes.
point_anchors anchors_among(const near_nodes& near, index_t count) {
  const auto n = std::min(static_cast<std::size_t>(count), near.nodes.size());
  point_anchors found;
  if (n == 0) return found;
  // Where all nodes are anchors, the farthest must count for something, too.
  const double end = near.nodes.size() > n ? near.distances[n] : 2 * near.distances[n - 1];
  std::vector<std::pair<std::int32_t, double>> weighted;
  double sum = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const double rest = end > 0 ? 1 - near.distances[k] / end : 1;
    if (rest <= 0) continue;
    weighted.emplace_back(near.nodes[k], rest * rest);
    sum += rest * rest;
  }
  if (weighted.empty())  // All nodes are at the same distance.
    for (std::size_t k = 0; k < n; ++k, ++sum) weighted.emplace_back(near.nodes[k], 1);
  std::ranges::sort(weighted);
  for (const auto& [node, weight] : weighted) {
    found.nodes.push_back(node);
    found.weights.push_back(weight / sum);
  }
  return found;
}

template <Scalar S>
near_nodes near_nodes_of(const neighborhood<S>& near) {
  near_nodes all;
  for (const auto& [node, distance] : near) {
    all.nodes.push_back(static_cast<std::int32_t>(node));
    all.distances.push_back(static_cast<double>(distance));
  }
  return all;
}

/// The means of the points in cells. The grid moves with the points, so that nodes do.
template <Scalar S, int D>
point_matrix<S, D> nodes_in_cells(const point_matrix<S, D>& points, double spacing, int threads) {
  Eigen::VectorXd corner =
      Eigen::VectorXd::Constant(points.rows(), std::numeric_limits<double>::infinity());
  for (index_t i = 0; i < points.cols(); ++i)
    if (is_finite(points.col(i))) corner = corner.cwiseMin(points.col(i).template cast<double>());
  if (!corner.allFinite()) return point_matrix<S, D>(points.rows(), 0);
  // No point of a regular scan should be on the border of a cell, where rounding decides.
  corner.array() -= 0.37 * spacing;
  return voxel_downsample(points, voxel_size{spacing},
                          {.origin = coordinates{corner}, .threads = threads});
}

/// A place on a path: how far it is from where the path begins, of which node that is, and where.
struct path_end {
  double distance;
  std::int32_t node, point;
  friend auto operator<=>(const path_end&, const path_end&) = default;
};
using path_queue = std::priority_queue<path_end, std::vector<path_end>, std::greater<>>;

/// Points that are at least `spacing` apart, along connections, such that all others are nearer.
template <Scalar S, int D>
index_list spread_along(const neighborhoods<S>& connections, const point_matrix<S, D>& points,
                        double spacing) {
  index_list nodes;
  std::vector<double> distances(static_cast<std::size_t>(points.cols()),
                                std::numeric_limits<double>::infinity());
  for (std::int32_t i = 0; i < points.cols(); ++i) {
    if (!is_finite(points.col(i)) || distances[i] < spacing) continue;
    nodes.push_back(i);
    path_queue open;
    distances[i] = 0;
    open.push({0, 0, i});
    while (!open.empty()) {
      const auto [distance, node, point] = open.top();
      open.pop();
      if (distance > distances[point]) continue;
      for (const auto& [next, step] : connections[point]) {
        const double there = distance + static_cast<double>(step);
        if (there >= spacing || there >= distances[next]) continue;
        distances[next] = there;
        open.push({there, 0, static_cast<std::int32_t>(next)});
      }
    }
  }
  return nodes;
}

/// For each point the `count` nodes nearest to it along connections.
template <Scalar S>
std::vector<near_nodes> near_along(const neighborhoods<S>& connections, const index_list& nodes,
                                   index_t count) {
  std::vector<near_nodes> near(static_cast<std::size_t>(connections.size()));
  path_queue open;
  for (std::int32_t k = 0; k < std::ssize(nodes); ++k) open.push({0, k, nodes[k]});
  while (!open.empty()) {
    const auto [distance, node, point] = open.top();
    open.pop();
    auto& [known, distances] = near[point];
    if (std::ssize(known) == count || std::ranges::find(known, node) != known.end()) continue;
    known.push_back(node);
    distances.push_back(distance);
    for (const auto& [next, step] : connections[point])
      if (std::ssize(near[next].nodes) < count)
        open.push({distance + static_cast<double>(step), node, static_cast<std::int32_t>(next)});
  }
  return near;
}

/// Puts points with the same anchors together. O(N log N).
template <Scalar S, int D>
void make_groups(deformation_graph_data<S, D>& graph) {
  const index_t k = graph.anchors_per_point;
  const auto anchors_of = [&](std::int32_t i) { return graph.anchors.data() + i * k; };
  for (std::int32_t i = 0; i < graph.points.cols(); ++i)
    if (anchors_of(i)[0] >= 0) graph.order.push_back(i);
  const auto compare = [&](std::int32_t a, std::int32_t b) {
    return std::lexicographical_compare_three_way(anchors_of(a), anchors_of(a) + k, anchors_of(b),
                                                  anchors_of(b) + k);
  };
  std::ranges::sort(graph.order, [&](std::int32_t a, std::int32_t b) {
    const auto order = compare(a, b);
    return order != 0 ? order < 0 : a < b;
  });
  graph.groups.push_back(0);
  for (index_t i = 1; i <= std::ssize(graph.order); ++i)
    if (i == std::ssize(graph.order) || compare(graph.order[i - 1], graph.order[i]) != 0)
      graph.groups.push_back(i);
}

/// Pairs of nodes that move a point together.
template <Scalar S, int D>
node_pairs links_by_groups(const deformation_graph_data<S, D>& graph) {
  node_pairs links;
  for (std::size_t g = 0; g + 1 < graph.groups.size(); ++g) {
    const std::int32_t* anchors =
        graph.anchors.data() + graph.order[graph.groups[g]] * graph.anchors_per_point;
    for (index_t a = 0; a < graph.anchors_per_point && anchors[a] >= 0; ++a)
      for (index_t b = 0; b < a; ++b) links.emplace_back(anchors[b], anchors[a]);
  }
  std::ranges::sort(links);
  const auto rest = std::ranges::unique(links);
  links.erase(rest.begin(), rest.end());
  return links;
}

template <Scalar S>
node_pairs links_of(const neighborhoods<S>& graph) {
  node_pairs links;
  for (std::int32_t i = 0; i < graph.size(); ++i)
    for (const auto& [j, distance] : graph[i])
      if (j > i) links.emplace_back(i, static_cast<std::int32_t>(j));
  std::ranges::sort(links);
  return links;
}

template <Scalar S, int D>
std::shared_ptr<const deformation_graph_data<S, D>> build(
    points_view<S, D> points, const points_view<S, D>* nodes, const neighborhoods<S>* connections,
    const deformation_graph_options& options) {
  const index_t k = options.anchors;
  expects(1 <= k && std::cmp_less_equal(k, most_anchors),
          "deformation_graph: anchors must be from 1 to " + std::to_string(most_anchors));
  expects(!nodes || options.spacing == 0,
          "deformation_graph: the nodes are given, so leave .spacing out");
  expects(nodes || (options.spacing > 0 && std::isfinite(options.spacing)),
          "deformation_graph: .spacing, the distance between nodes, must be positive and finite");
  expects(!nodes || nodes->empty() || points.empty() || nodes->dimension() == points.dimension(),
          "deformation_graph: nodes and points must have the same dimension");
  expects(!connections || connections->size() == points.size(),
          "deformation_graph: there must be one neighbourhood of connections for each point");

  auto graph = std::make_shared<deformation_graph_data<S, D>>();
  graph->points.resize(points.dimension(), points.size());
  for (index_t i = 0; i < points.size(); ++i) graph->points.col(i) = points[i];
  graph->anchors_per_point = k;
  graph->anchors.assign(static_cast<std::size_t>(points.size() * k), -1);
  graph->weights.assign(static_cast<std::size_t>(points.size() * k), 0);
  graph->is_along_connections = connections != nullptr;
  const auto keep = [&](index_t i, const near_nodes& near) {
    const auto found = anchors_among(near, k);
    std::ranges::copy(found.nodes, graph->anchors.begin() + i * k);
    std::ranges::copy(found.weights, graph->weights.begin() + i * k);
  };

  if (connections) {
    const auto both_ways = neighbor_graph(*connections, {.threads = options.threads});
    const auto spread = spread_along(both_ways, graph->points, options.spacing);
    graph->nodes.resize(points.dimension(), std::ssize(spread));
    for (index_t n = 0; n < graph->nodes.cols(); ++n) graph->nodes.col(n) = points[spread[n]];
    const auto near = near_along(both_ways, spread, k + 1);
    for (index_t i = 0; i < points.size(); ++i) keep(i, near[i]);
  } else if (nodes) {
    graph->nodes.resize(points.dimension(), nodes->size());
    index_t count = 0;
    for (const auto& node : *nodes)
      if (is_finite(node)) graph->nodes.col(count++) = node;
    graph->nodes.conservativeResize(Eigen::Index(points.dimension()), count);
  } else {
    graph->nodes = nodes_in_cells<S, D>(graph->points, options.spacing, options.threads);
  }

  if (graph->nodes.cols() > 0) {
    const auto view = as_points(graph->nodes);
    graph->tree.emplace(view, kd_tree_options{.threads = options.threads});
    if (!connections) {
      const auto near = find_neighborhoods(*graph->tree, as_points(graph->points), knn{k + 1},
                                           {.threads = options.threads});
      parallel_for(points.size(), {.threads = options.threads},
                   [&](index_t i) { keep(i, near_nodes_of(near[i])); });
    }
    make_groups(*graph);
    graph->links = connections ? links_by_groups(*graph)
                               : links_of(neighbor_graph(*graph->tree, view, options.links,
                                                         {.threads = options.threads}));
  }
  return graph;
}

}  // namespace

template <Scalar S, int D>
std::shared_ptr<const deformation_graph_data<S, D>> make_deformation_graph(
    points_view<S, D> points, const points_view<S, D>* nodes, const neighborhoods<S>* connections,
    const deformation_graph_options& options) {
  return build(points, nodes, connections, options);
}

template <Scalar S, int D>
point_anchors anchors_at(const deformation_graph_data<S, D>& graph,
                         const point_vector<S, D>& place) {
  if (!graph.tree || !is_finite(place)) return {};
  near_nodes near;
  for (const auto& [node, distance] : graph.tree->find(place, knn{graph.anchors_per_point + 1})) {
    near.nodes.push_back(static_cast<std::int32_t>(node));
    near.distances.push_back(static_cast<double>(distance));
  }
  return anchors_among(near, graph.anchors_per_point);
}

#define CILANTRO_INSTANTIATE(S, D)                                                     \
  template std::shared_ptr<const deformation_graph_data<S, D>> make_deformation_graph( \
      points_view<S, D>, const points_view<S, D>*, const neighborhoods<S>*,            \
      const deformation_graph_options&);                                               \
  template point_anchors anchors_at(const deformation_graph_data<S, D>&, const point_vector<S, D>&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
