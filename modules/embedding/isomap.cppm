// SPDX-License-Identifier: MIT
export module cilantro.embedding:isomap;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :multidimensional_scaling;

namespace cilantro {

/// Coordinates of points along the surface that they lie on.
export struct isomap_result : embedding_result {
  /// The indices of the points that are embedded, ascending: column c of `points` belongs to point
  /// `kept[c]`. All points if the graph is connected.
  index_list kept;
  index_t components = 0;  ///< The number of connected components of the graph.
};

/// The most points that `isomap` accepts: the N² distances of these take 20 GB.
export inline constexpr index_t most_isomap_points = 50000;

/// Embeds the nodes of a graph with the lengths of shortest paths as distances, which unrolls a
/// curved surface. If the graph has several components, only the largest is embedded (of equally
/// large ones the first), since distances between components are unknown. Edges count in both
/// directions. Throws as `multidimensional_scaling` and `shortest_paths` do, and `invalid_input`
/// for more than `most_isomap_points` nodes. O(N · E log N) and 16 N² bytes.
/// Source: Tenenbaum, de Silva & Langford 2000, "A global geometric framework for nonlinear
/// dimensionality reduction".
export template <Scalar S>
[[nodiscard]] isomap_result isomap(const neighborhoods<S>& graph,
                                   const embedding_options& options = {});

/// As above, with the graph of the points' neighbourhoods. Points that are not finite are not
/// embedded.
export template <PointsSource P>
[[nodiscard]] isomap_result isomap(const P& points, neighborhood_spec spec,
                                   const embedding_options& options = {}) {
  const auto view = points_in(points);
  if (view.empty()) return {};
  expects(view.size() <= most_isomap_points,
          "isomap: there are too many points for a matrix of all distances; take a sample");
  const kd_tree tree{view, {.threads = options.threads}};
  return isomap(find_neighborhoods(tree, view, spec, {options.threads, {{}, options.monitor.stop}}),
                options);
}

}  // namespace cilantro
