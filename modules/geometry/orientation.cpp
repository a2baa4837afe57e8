// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
module cilantro.geometry;

import cilantro.numeric;

namespace cilantro {
namespace {

template <class S>
struct costly_edge {
  S cost;
  std::int32_t i, j;
  friend auto operator<=>(const costly_edge&, const costly_edge&) = default;
};

/// How many edges there will be at most, where that is known: growing would hold twice as many.
template <Scalar S, int D>
index_t edge_count(points_view<S, D>, const neighborhoods<S>& graph) {
  return graph.total();
}
template <Scalar S, int D>
index_t edge_count(points_view<S, D> points, const neighborhood_spec& spec) {
  if (!spec.is_count_limited() || std::isfinite(spec.max_distance())) return 0;
  return points.size() * std::clamp<index_t>(spec.max_count() - 1, 0, points.size());
}

/// Hands each neighbour j of each point i to `add(i, j)`.
template <Scalar S, int D, class F>
void for_each_edge(points_view<S, D> points, const neighborhoods<S>& graph, F add) {
  expects(graph.size() == points.size(),
          "orient_consistently: the graph must have one node per point");
  expects(std::ranges::all_of(graph.indices(),
                              [&](std::int32_t i) { return 0 <= i && i < points.size(); }),
          "orient_consistently: a neighbor is not one of the points");
  for (index_t i = 0; i < points.size(); ++i)
    for (const auto j : graph[i].indices()) add(static_cast<std::int32_t>(i), j);
}

/// As above, of neighbourhoods that are found some thousands at a time, and not kept.
template <Scalar S, int D, class F>
void for_each_edge(points_view<S, D> points, const neighborhood_spec& spec, F add) {
  constexpr index_t at_a_time = 1 << 14;
  const kd_tree<S, D> tree{points};
  for (index_t first = 0; first < points.size(); first += at_a_time) {
    const index_t n = std::min(at_a_time, points.size() - first);
    const auto near = tree.find_all(points.slice(first, n), spec);
    for (index_t i = 0; i < n; ++i)
      for (const auto j : near[i].indices()) add(static_cast<std::int32_t>(first + i), j);
  }
}

}  // namespace

template <Scalar S, int D, class Near>
index_t closed_orient_consistently(points_view<S, D> points, const Near& near,
                                   const point_vector<S, D>* viewpoint,
                                   mutable_points_view<S, D> normals) {
  const index_t n = points.size();
  const auto normal = [&](index_t i) { return normals[i]; };
  const auto is_known = [&](index_t i) {
    return is_finite(points[i]) && is_finite(normal(i)) && !normal(i).isZero(0);
  };

  std::vector<costly_edge<S>> edges;
  edges.reserve(edge_count(points, near));
  for_each_edge(points, near, [&](std::int32_t i, std::int32_t j) {
    if (i != j && is_known(i) && is_known(j))
      edges.push_back(
          {1 - std::min(S(1), std::abs(normal(i).dot(normal(j)))), std::min(i, j), std::max(i, j)});
  });
  std::ranges::sort(edges);
  // Kruskal's algorithm; what stays in `edges` is the tree, or a tree per part. An edge that was
  // found from both of its ends does no harm.
  disjoint_sets parts{n};
  std::erase_if(edges, [&](const costly_edge<S>& e) { return !parts.join(e.i, e.j); });
  edges.shrink_to_fit();
  std::vector<index_t> offsets(static_cast<std::size_t>(n) + 1);
  for (const auto& e : edges)
    for (const auto end : {e.i, e.j}) ++offsets[static_cast<std::size_t>(end) + 1];
  std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
  std::vector<std::int32_t> next(offsets.back());
  auto place = offsets;
  for (const auto& e : edges)
    for (const auto& [from, to] : {std::pair{e.i, e.j}, std::pair{e.j, e.i}})
      next[place[from]++] = to;

  // The root of each part: the nearest to the viewpoint, or the highest.
  const auto rank = [&](index_t i) {
    return viewpoint ? (points[i] - *viewpoint).squaredNorm() : -points[i][points.dimension() - 1];
  };
  std::vector<std::int32_t> root(static_cast<std::size_t>(n), -1);
  for (index_t i = 0; i < n; ++i) {
    if (!is_known(i)) continue;
    auto& best = root[parts.find(i)];
    if (best < 0 || rank(i) < rank(best)) best = static_cast<std::int32_t>(i);
  }

  index_t count = 0;
  std::vector<std::pair<std::int32_t, std::int32_t>>
      open;  // A node, and where it was reached from.
  for (const std::int32_t r : root) {
    if (r < 0) continue;
    ++count;
    const S side =
        viewpoint ? normal(r).dot(*viewpoint - points[r]) : normal(r)[points.dimension() - 1];
    if (side < 0) normal(r) = -normal(r);
    open.emplace_back(r, -1);
    while (!open.empty()) {
      const auto [i, from] = open.back();
      open.pop_back();
      for (index_t e = offsets[i]; e < offsets[static_cast<std::size_t>(i) + 1]; ++e) {
        const std::int32_t j = next[e];
        if (j == from) continue;
        if (normal(i).dot(normal(j)) < 0) normal(j) = -normal(j);
        open.emplace_back(j, i);
      }
    }
  }
  return count;
}

#define CILANTRO_INSTANTIATE(S, D)                                                               \
  template index_t closed_orient_consistently<S, D>(points_view<S, D>, const neighborhoods<S>&,  \
                                                    const point_vector<S, D>*,                   \
                                                    mutable_points_view<S, D>);                  \
  template index_t closed_orient_consistently<S, D>(points_view<S, D>, const neighborhood_spec&, \
                                                    const point_vector<S, D>*,                   \
                                                    mutable_points_view<S, D>);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
