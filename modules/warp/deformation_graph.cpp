// SPDX-License-Identifier: MIT
module;
#include <queue>

#include "core/closed_spaces.hpp"
module cilantro.warp;

namespace cilantro {
namespace {

using node_pairs = std::vector<std::pair<std::int32_t, std::int32_t>>;

/// Nodes with their distances, ascending; one more than the anchors, if there are so many.
struct near_nodes {
  std::size_t count = 0;
  std::array<std::pair<std::int32_t, double>, most_anchors + 1> all;

  void add(std::int32_t node, double distance) { all[count++] = {node, distance}; }
  [[nodiscard]] auto begin() const { return all.begin(); }
  [[nodiscard]] auto end() const { return all.begin() + count; }
};
template <class Neighbors>
near_nodes near_nodes_of(const Neighbors& neighbors) {
  near_nodes near;
  for (const auto& [node, distance] : neighbors)
    near.add(static_cast<std::int32_t>(node), static_cast<double>(distance));
  return near;
}

/// The weights of the first `count` nodes, which fade out at `reach`.
point_anchors anchors_among(const near_nodes& near, index_t count, double reach) {
  const auto n = std::min(static_cast<std::size_t>(count), near.count);
  point_anchors found;
  if (n == 0) return found;
  // Where all nodes are anchors, the farthest must count for something, too.
  const double end =
      std::min(near.count > n ? near.all[n].second : 2 * near.all[n - 1].second, reach);
  std::array<std::pair<std::int32_t, double>, most_anchors> weighted;
  double sum = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const double rest = end > 0 ? 1 - near.all[k].second / end : 1;
    if (rest <= 0) continue;
    weighted[found.count++] = {near.all[k].first, rest * rest};
    sum += rest * rest;
  }
  if (found.count == 0) {
    // All are at the same distance, or out of reach.
    const std::size_t all = near.all[0].second < reach ? n : 1;
    for (; found.count < all; ++sum) {
      weighted[found.count] = {near.all[found.count].first, 1};
      ++found.count;
    }
  }
  std::sort(weighted.begin(), weighted.begin() + found.count);
  for (std::size_t k = 0; k < found.count; ++k) {
    found.all_nodes[k] = weighted[k].first;
    found.all_weights[k] = weighted[k].second / sum;
  }
  return found;
}

/// Where a cell is on a curve that visits neighbours soon after each other (Morton 1966): the bits
/// of its coordinates in turn.
std::uint64_t place_on_curve(const Eigen::VectorXd& cell) {
  const index_t d = cell.size();
  std::uint64_t place = 0;
  for (index_t bit = std::min<index_t>(64 / d, 20) - 1; bit >= 0; --bit)
    for (index_t axis = 0; axis < d; ++axis)
      place = place << 1 | (static_cast<std::uint64_t>(cell[axis]) >> bit & 1);
  return place;
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
  const auto nodes = voxel_downsample(points, voxel_size{spacing},
                                      {.origin = coordinates{corner}, .threads = threads});
  // Nodes with near indices should be near each other: sums over some of them then meet few others.
  std::vector<std::pair<std::uint64_t, std::int32_t>> order;
  for (std::int32_t k = 0; k < nodes.cols(); ++k)
    order.emplace_back(place_on_curve((nodes.col(k).template cast<double>() - corner) / spacing),
                       k);
  std::ranges::sort(order);
  point_matrix<S, D> sorted(nodes.rows(), nodes.cols());
  for (index_t k = 0; k < nodes.cols(); ++k) sorted.col(k) = nodes.col(order[k].second);
  return sorted;
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

/// The connections between finite points.
template <Scalar S, int D>
neighborhoods<S> usable_connections(const neighborhoods<S>& connections,
                                    const point_matrix<S, D>& points, int threads) {
  std::vector<index_t> offsets{0};
  buffer<std::int32_t> indices;
  buffer<S> distances;
  for (index_t i = 0; i < connections.size(); ++i) {
    for (const auto& [j, distance] : connections[i]) {
      expects(0 <= j && j < points.cols(),
              "deformation_graph: a connection leads to a point that there is not");
      if (!is_finite(points.col(i)) || !is_finite(points.col(j))) continue;
      expects(distance >= 0, "deformation_graph: the length of a connection is negative or NaN");
      indices.push_back(static_cast<std::int32_t>(j));
      distances.push_back(distance);
    }
    offsets.push_back(std::ssize(indices));
  }
  return neighbor_graph(
      neighborhoods<S>{std::move(offsets), std::move(indices), std::move(distances)},
      {.threads = threads});
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
    auto& known = near[point];
    if (std::cmp_equal(known.count, count) ||
        std::ranges::any_of(known, [&](const auto& one) { return one.first == node; }))
      continue;
    known.add(node, distance);
    for (const auto& [next, step] : connections[point])
      if (std::cmp_less(near[next].count, count))
        open.push({distance + static_cast<double>(step), node, static_cast<std::int32_t>(next)});
  }
  return near;
}

/// The anchors of all points: so many each, ascending, −1 where there are fewer; and their weights.
struct anchor_table {
  index_t per_point;
  std::vector<std::int32_t> nodes;
  std::vector<double> weights;

  anchor_table(index_t points, index_t each)
      : per_point{each},
        nodes(static_cast<std::size_t>(points * each), -1),
        weights(static_cast<std::size_t>(points * each), 0) {}
  void set(index_t point, const point_anchors& anchors) {
    std::ranges::copy(anchors.nodes(), nodes.begin() + point * per_point);
    std::ranges::copy(anchors.weights(), weights.begin() + point * per_point);
  }
  [[nodiscard]] auto nodes_of(index_t point) const {
    return std::span{nodes}.subspan(static_cast<std::size_t>(point * per_point),
                                    static_cast<std::size_t>(per_point));
  }
};

/// Puts points with the same anchors together. O(N log N).
template <Scalar S, int D>
void make_groups(deformation_graph_data<S, D>& graph, const anchor_table& anchors, int threads) {
  const auto points = static_cast<std::size_t>(graph.points.cols());
  const auto compare = [&](std::int32_t a, std::int32_t b) {
    const auto of_a = anchors.nodes_of(a), of_b = anchors.nodes_of(b);
    return std::lexicographical_compare_three_way(of_a.begin(), of_a.end(), of_b.begin(),
                                                  of_b.end());
  };
  // By the first node with counts, and then those of each node among themselves.
  std::vector<index_t> begins(static_cast<std::size_t>(graph.nodes.cols()) + 2, 0);
  for (std::int32_t i = 0; i < graph.points.cols(); ++i) ++begins[anchors.nodes_of(i)[0] + 2];
  begins[1] = 0;  // Points without a node are in no group.
  std::partial_sum(begins.begin(), begins.end(), begins.begin());
  graph.order.resize(static_cast<std::size_t>(begins.back()));
  auto next = begins;
  for (std::int32_t i = 0; i < graph.points.cols(); ++i)
    if (const auto first = anchors.nodes_of(i)[0]; first >= 0) graph.order[next[first + 1]++] = i;
  parallel_for(graph.nodes.cols(), {.threads = threads}, [&](index_t node) {
    std::ranges::sort(graph.order.begin() + begins[node + 1],
                      graph.order.begin() + begins[node + 2], [&](std::int32_t a, std::int32_t b) {
                        const auto order = compare(a, b);
                        return order != 0 ? order < 0 : a < b;
                      });
  });
  const index_t n = std::ssize(graph.order), k = graph.anchors_per_point;
  graph.weights.resize(static_cast<std::size_t>(n * k));
  graph.group_of.assign(points, -1);
  graph.place_of.assign(points, -1);
  for (index_t place = 0; place < n; ++place) {
    const std::int32_t point = graph.order[place];
    if (place == 0 || compare(graph.order[place - 1], point) != 0) {
      if (place > 0) graph.groups.push_back(place);
      const auto nodes = anchors.nodes_of(point);
      graph.anchors.insert(graph.anchors.end(), nodes.begin(), nodes.end());
    }
    graph.group_of[point] = static_cast<std::int32_t>(graph.groups.size() - 1);
    graph.place_of[point] = static_cast<std::int32_t>(place);
    std::copy_n(anchors.weights.begin() + point * k, k, graph.weights.begin() + place * k);
  }
  if (n > 0) graph.groups.push_back(n);
}

/// Pairs of nodes that move a point together.
template <Scalar S, int D>
node_pairs links_by_groups(const deformation_graph_data<S, D>& graph) {
  node_pairs links;
  for (index_t g = 0; g < graph.group_count(); ++g) {
    const auto nodes = graph.anchors_of(g);
    for (std::size_t a = 0; a < nodes.size(); ++a)
      for (std::size_t b = 0; b < a; ++b) links.emplace_back(nodes[b], nodes[a]);
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
  expects(!nodes || points.dimension() == 0 || nodes->dimension() == points.dimension(),
          "deformation_graph: nodes and points must have the same dimension");
  expects(!connections || connections->size() == points.size(),
          "deformation_graph: there must be one neighbourhood of connections for each point");

  auto graph = std::make_shared<deformation_graph_data<S, D>>();
  graph->points.resize(points.dimension(), points.size());
  for (index_t i = 0; i < points.size(); ++i) graph->points.col(i) = points[i];
  graph->anchors_per_point = k;
  if (!nodes) graph->reach = 2 * std::sqrt(double(points.dimension())) * options.spacing;
  anchor_table anchors{points.size(), k};

  if (connections) {
    const auto both_ways = usable_connections(*connections, graph->points, options.threads);
    const auto spread = spread_along(both_ways, graph->points, options.spacing);
    graph->nodes.resize(points.dimension(), std::ssize(spread));
    for (index_t n = 0; n < graph->nodes.cols(); ++n) graph->nodes.col(n) = points[spread[n]];
    const auto near = near_along(both_ways, spread, k + 1);
    for (index_t i = 0; i < points.size(); ++i)
      anchors.set(i, anchors_among(near[i], k, std::numeric_limits<double>::infinity()));
  } else if (nodes) {
    graph->nodes.resize(nodes->dimension(), nodes->size());
    index_t count = 0;
    for (const auto& node : *nodes)
      if (is_finite(node)) graph->nodes.col(count++) = node;
    graph->nodes.conservativeResize(Eigen::Index(nodes->dimension()), count);
  } else {
    graph->nodes = nodes_in_cells<S, D>(graph->points, options.spacing, options.threads);
  }

  if (graph->nodes.cols() > 0) {
    const auto view = as_points(graph->nodes);
    graph->tree.emplace(view, kd_tree_options{.threads = options.threads});
    if (!connections) {
      const auto near = find_neighborhoods(*graph->tree, as_points(graph->points), knn{k + 1},
                                           {.threads = options.threads});
      parallel_for(points.size(), {.threads = options.threads}, [&](index_t i) {
        anchors.set(i, anchors_among(near_nodes_of(near[i]), k, graph->reach));
      });
    }
    make_groups(*graph, anchors, options.threads);
    graph->links = connections ? links_by_groups(*graph)
                               : links_of(neighbor_graph(*graph->tree, view, options.links,
                                                         {.threads = options.threads}));
  } else {
    make_groups(*graph, anchors, options.threads);
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
  return anchors_among(near_nodes_of(graph.tree->find(place, knn{graph.anchors_per_point + 1})),
                       graph.anchors_per_point, graph.reach);
}

#define CILANTRO_INSTANTIATE(S, D)                                                     \
  template std::shared_ptr<const deformation_graph_data<S, D>> make_deformation_graph( \
      points_view<S, D>, const points_view<S, D>*, const neighborhoods<S>*,            \
      const deformation_graph_options&);                                               \
  template point_anchors anchors_at(const deformation_graph_data<S, D>&, const point_vector<S, D>&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
