// SPDX-License-Identifier: MIT
export module cilantro.clustering:hdbscan;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :clusters;

namespace cilantro {

export struct hdbscan_options {
  index_t min_cluster_size = 5;  ///< Fewer points are no cluster.
  /// The core distance of a point is the distance to its `min_points`-th nearest, itself included.
  index_t min_points = 5;
  /// Whether all points may be one cluster.
  bool allow_single_cluster = false;
  int threads = 0;  ///< For finding neighbours; the hierarchy is made by one.
  task_monitor monitor = {};
};

export struct hdbscan_result : clusters {
  /// One a cluster: how long it lasts while the density rises (excess of mass), Σ (λ − λ_birth).
  std::vector<double> stabilities;
  /// One a point: how deep it lies in its cluster, from 0 to 1; 0 for noise.
  std::vector<double> strengths;
};

/// Density-based clusters of any density, from the hierarchy of a neighbour graph.
///
/// The graph stands for the points: those that are not neighbours in either direction count as
/// infinitely far apart. With the neighbours of a `knn{k}` where k is well above `min_points`, 15
/// to 30, this differs from the hierarchy of all pairs only where clusters are far apart, and with
/// k = N it is the same. Neighbourhoods contain the point itself, as searches find it; a point
/// without any is noise. The same for the points in any order. O(E log E), 32 bytes an edge.
/// Throws `invalid_input` for a neighbour that is no node, for a distance that is negative or NaN,
/// and for a size or count below 1 (of clusters: 2).
/// Source: Campello, Moulavi, Zimek & Sander 2015, "Hierarchical density estimates for data
/// clustering", algorithms 1 and 3; the condensed tree of McInnes & Healy 2017.
export template <Scalar S>
[[nodiscard]] hdbscan_result hdbscan(const neighborhoods<S>& graph,
                                     const hdbscan_options& options = {});

/// As above, over the `neighbors` nearest of each point (at least `min_points` are taken).
export template <PointsSource P>
[[nodiscard]] hdbscan_result hdbscan(const P& points, knn neighbors,
                                     const hdbscan_options& options = {}) {
  (void)neighborhood_spec{neighbors};  // Which refuses what is no number of neighbours.
  const auto view = points_in(points);
  if (view.empty()) return {};
  const kd_tree tree{view, {.threads = options.threads}};
  const knn spec{std::max(neighbors.k, options.min_points)};
  auto rest = options;
  rest.monitor = in_passes(options.monitor, 2);
  const auto graph = find_neighborhoods(tree, view, spec, {options.threads, rest.monitor});
  return hdbscan(graph, rest);
}

}  // namespace cilantro
