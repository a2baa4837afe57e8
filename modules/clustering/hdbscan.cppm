// SPDX-License-Identifier: MIT
export module cilantro.clustering:hdbscan;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :clusters;

namespace cilantro {

/// Options of `hdbscan`.
export struct hdbscan_options {
  index_t min_cluster_size = 5;  ///< Fewer points do not form a cluster; at least 2.
  /// The core distance of a point is the distance to its `min_points`-th nearest point, itself
  /// included.
  index_t min_points = 5;
  /// Whether all points may form a single cluster.
  bool allow_single_cluster = false;
  int threads = 0;  ///< For finding neighbours; the hierarchy is built by one thread.
  task_monitor monitor = {};
};

/// The clusters, and how pronounced they are.
export struct hdbscan_result : clusters {
  /// One per cluster: its excess of mass Σ (λ − λ_birth), which tells how long it persists while
  /// the density threshold λ rises.
  std::vector<double> stabilities;
  /// One per point: how strongly it belongs to its cluster, from 0 to 1; 0 for noise.
  std::vector<double> strengths;
};

/// Density-based clusters of any density, from the hierarchy of a neighbour graph.
///
/// The graph replaces the distances of all pairs: points that are not neighbours in either
/// direction count as infinitely far apart. If the graph has the neighbours of a `knn{k}` with k
/// well above `min_points`, such as 15 to 30, the result differs from the hierarchy of all pairs
/// only where clusters are far apart; with k = N it is the same. Neighbourhoods contain the point
/// itself, as searches find it; a point without neighbours is noise. The result does not depend on
/// the order of the points. O(E log E), 32 bytes per edge. Throws `invalid_input` for a neighbour
/// that is not a node, for a distance that is negative or NaN, for `min_points` below 1, and for
/// `min_cluster_size` below 2.
/// Source: Campello, Moulavi, Zimek & Sander 2015, "Hierarchical density estimates for data
/// clustering", algorithms 1 and 3; the condensed tree of McInnes & Healy 2017.
export template <Scalar S>
[[nodiscard]] hdbscan_result hdbscan(const neighborhoods<S>& graph,
                                     const hdbscan_options& options = {});

/// As above, with the graph of the k nearest neighbours of each point; k is raised to `min_points`
/// if it is smaller.
export template <PointsSource P>
[[nodiscard]] hdbscan_result hdbscan(const P& points, knn neighbors,
                                     const hdbscan_options& options = {}) {
  (void)neighborhood_spec{neighbors};  // Throws for an invalid k.
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
