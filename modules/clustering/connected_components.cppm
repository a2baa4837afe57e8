// SPDX-License-Identifier: MIT
export module cilantro.clustering:connected_components;

import cilantro.standard;
import cilantro.core;
import cilantro.numeric;
import cilantro.search;
import :clusters;

namespace cilantro {

/// All neighbours are similar, so that components depend on distance alone.
export struct always_similar {
  template <Scalar S>
  bool operator()(index_t, index_t, S) const {
    return true;
  }
};

/// Options of `connected_components`.
export struct components_options {
  /// If given, only components that contain one of these points become clusters.
  std::optional<index_list> seeds = {};
  index_t min_cluster_size = 1;  ///< Components with fewer points do not become clusters.
  /// Components with more points do not become clusters.
  index_t max_cluster_size = std::numeric_limits<index_t>::max();
  int threads = 0;
  task_monitor monitor = {};
};

/// Throws `invalid_input` for negative sizes, and for seeds that are out of range.
void expect_sensible(const components_options& options, index_t size);
/// The sets that become clusters, without the nodes for which `belongs`, if not empty, is 0.
clusters components_of(disjoint_sets& sets, std::span<const std::uint8_t> belongs,
                       const components_options& options);

/// Joins node i with those of its neighbours that are similar to it and not yet in its set, so that
/// most pairs on a smooth surface cost two reads and no comparison.
template <Scalar S, class Near, class F>
void join_similar(disjoint_sets& sets, index_t i, const Near& near, const F& similar) {
  index_t root = sets.find(i);
  for (const auto& [j, distance] : near) {
    if (j == i || sets.find(j) == root || !evaluate_pair(similar, i, j, S(distance))) continue;
    sets.join(i, j);
    root = sets.find(i);
  }
}

/// The connected components of the graph whose nodes are the points, and whose edges are the pairs
/// of neighbours, in either direction, that are similar. A node without a similar neighbour is a
/// component of its own. The same for any number of threads. O(E) time and O(N) memory. Throws
/// `invalid_input` for a neighbour that is not a node; `cancelled`.
export template <Scalar S, SimilarityFunction<S> F = always_similar>
[[nodiscard]] clusters connected_components(const neighborhoods<S>& graph, const F& similar = {},
                                            const components_options& options = {}) {
  expect_sensible(options, graph.size());
  expect_nodes(graph, "connected_components");
  expect_sizes(similar, graph.size(), graph.size(), "connected_components");
  disjoint_sets sets{graph.size()};
  parallel_for(graph.size(), {options.threads, options.monitor},
               [&](index_t i) { join_similar<S>(sets, i, graph[i], similar); });
  return components_of(sets, {}, options);
}

/// As above, where all neighbours are similar.
export template <Scalar S>
[[nodiscard]] clusters connected_components(const neighborhoods<S>& graph,
                                            const components_options& options) {
  return connected_components(graph, always_similar{}, options);
}

/// Which points have been joined, and which are in a set at all.
struct joined_points {
  explicit joined_points(index_t size) : sets{size}, belongs(size) {}
  disjoint_sets sets;
  std::vector<std::uint8_t> belongs;
};

template <NeighborSearcher T, SimilarityFunction<typename T::scalar> F>
[[nodiscard]] joined_points join_neighbors(
    const T& searcher, points_view<typename T::scalar, T::static_dimension> points,
    neighborhood_spec spec, const F& similar, const components_options& options) {
  using S = typename T::scalar;
  expect_sizes(similar, points.size(), points.size(), "connected_components");
  joined_points joined{points.size()};
  visit_neighborhoods(searcher, points, spec,
                      [&](const neighborhood_block<S>& block) {
                        for (index_t q = 0; q < block.size(); ++q) {
                          const index_t i = block.query(q);
                          if (!is_finite(points[i])) continue;
                          joined.belongs[i] = 1;
                          join_similar<S>(joined.sets, i, block[q], similar);
                        }
                      },
                      {.ascending = false, .threads = options.threads, .monitor = options.monitor});
  return joined;
}

/// As above, for points whose neighbours a searcher finds. Neighbours are compared as they are
/// found and not kept: memory is about 20 bytes per point beside the searcher, however large the
/// neighbourhoods. Points that are not finite are in no component. Throws `invalid_input` if
/// searcher and points differ in size.
export template <NeighborSearcher T, PointsSource P,
                 SimilarityFunction<typename T::scalar> F = always_similar>
[[nodiscard]] clusters connected_components(const T& searcher, const P& points,
                                            neighborhood_spec spec, const F& similar = {},
                                            const components_options& options = {}) {
  const points_view<typename T::scalar, T::static_dimension> view = points_in(points);
  expects(view.size() == index_t(searcher.size()),
          "connected_components: searcher and points must have the same size");
  expect_sensible(options, view.size());
  auto joined = join_neighbors(searcher, view, spec, similar, options);
  return components_of(joined.sets, joined.belongs, options);
}

/// As above, where all neighbours are similar.
export template <NeighborSearcher T, PointsSource P>
[[nodiscard]] clusters connected_components(const T& searcher, const P& points,
                                            neighborhood_spec spec,
                                            const components_options& options) {
  return connected_components(searcher, points, spec, always_similar{}, options);
}

/// As above, through a kd-tree.
export template <PointsSource P, SimilarityFunction<scalar_of<P>> F = always_similar>
[[nodiscard]] clusters connected_components(const P& points, neighborhood_spec spec,
                                            const F& similar = {},
                                            const components_options& options = {}) {
  const auto view = points_in(points);
  if (view.empty()) return {};
  expect_sensible(options, view.size());
  // The tree is freed before the components are made.
  auto joined =
      join_neighbors(kd_tree{view, {.threads = options.threads}}, view, spec, similar, options);
  return components_of(joined.sets, joined.belongs, options);
}
/// As above, where all neighbours are similar.
export template <PointsSource P>
[[nodiscard]] clusters connected_components(const P& points, neighborhood_spec spec,
                                            const components_options& options) {
  return connected_components(points, spec, always_similar{}, options);
}

}  // namespace cilantro
