// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
export module cilantro.search:graph;

import cilantro.standard;
import cilantro.core;
import :kd_tree;
import :neighbor_searcher;
import :neighborhood;
import :pair;
import :visit;
import :weight;

namespace cilantro {

/// Which edges a neighbour graph has: j may be among the nearest neighbours of i, but not i among
/// those of j.
export enum class graph_symmetry {
  none,    ///< i → j if j was found around i.
  either,  ///< Both i → j and j → i if either was found: the union.
  both,    ///< Both i → j and j → i if both were found: the intersection.
};

/// Options of `neighbor_graph`.
export struct graph_options {
  graph_symmetry symmetry = graph_symmetry::either;  ///< Which edges are kept or added.
  /// Whether each node is its own neighbour, at distance 0. (Nodes without any neighbour, such as
  /// points that are not finite, never are.)
  bool self = false;
  int threads = 0;
  task_monitor monitor = {};
};

/// Turns the neighbourhoods of N nodes, whose neighbours are nodes again, into a graph in the same
/// compressed form: symmetric or not, with or without self, each edge once, neighbours by ascending
/// distance and then index. If an edge was found with several distances, the smallest counts. O(E
/// log k). Throws `invalid_input` for a neighbour that is not one of the nodes.
export template <Scalar S>
[[nodiscard]] neighborhoods<S> neighbor_graph(const neighborhoods<S>& found,
                                              const graph_options& options = {});

template <Scalar S>
neighborhoods<S> without_self(const neighborhoods<S>& found, index_t max_count);

/// The graph of the points that a searcher was built from. Without self, `knn{k}` means k other
/// points. Throws `invalid_input` if searcher and points differ in size or dimension.
export template <NeighborSearcher T, PointsSource P>
[[nodiscard]] auto neighbor_graph(const T& searcher, const P& points, neighborhood_spec spec,
                                  const graph_options& options = {}) {
  expects(points_in(points).size() == index_t(searcher.size()),
          "neighbor_graph: searcher and points must have the same size");
  graph_options after = options;
  after.monitor = in_passes(options.monitor, 2);
  const execution how{options.threads, after.monitor};
  if (options.self || !spec.is_count_limited())
    return neighbor_graph(find_neighborhoods(searcher, points, spec, how), after);
  const knn_in_radius one_more{spec.max_count() + 1, spec.max_distance()};
  return neighbor_graph(
      without_self(find_neighborhoods(searcher, points, one_more, how), spec.max_count()), after);
}

/// As above, through a kd-tree.
export template <PointsSource P>
[[nodiscard]] auto neighbor_graph(const P& points, neighborhood_spec spec,
                                  const graph_options& options = {}) {
  const kd_tree tree{points, {.threads = options.threads}};
  return neighbor_graph(tree, points, spec, options);
}

template <Scalar S, int D>
neighborhoods<S> closed_edge_graph(points_view<S, D> points,
                                   const Eigen::Ref<const Eigen::MatrixXi>& simplices,
                                   const execution& how);

/// The graph of the edges of simplices, such as the triangles of a mesh (`3 × M`, the indices of
/// their points), tetrahedra (`4 × M`) or edges themselves (`2 × M`): both ways, each once, by
/// ascending length. Edges of points that are not finite are left out. Throws `invalid_input` for
/// an index that is not one of a point, and for simplices of fewer than two points or of more than
/// one more than there are dimensions. O(N + M).
export template <PointsSource P>
[[nodiscard]] auto edge_graph(const P& points, const Eigen::Ref<const Eigen::MatrixXi>& simplices,
                              const execution& how = {}) {
  using S = scalar_of<P>;
  constexpr int C = closed_dimension<dimension_of<P>>;
  return closed_edge_graph<S, C>(points_view<S, C>{points_in(points)}, simplices, how);
}

/// Options of `pixel_graph`.
export struct pixel_graph_options {
  int width = 0;  ///< Of the picture, in pixels. Required: an organised cloud knows its own.
  /// Longer edges are left out, in the units of the points: what lies before another surface is
  /// not joined to it.
  double max_distance = std::numeric_limits<double>::infinity();
};

template <Scalar S, int D>
neighborhoods<S> closed_pixel_graph(points_view<S, D> points, const pixel_graph_options& options,
                                    const execution& how);

/// The graph that joins each point of a picture, whose points are its pixels, row by row, to those
/// of the up to eight pixels around it, by ascending distance. Points that are not finite have no
/// neighbours. Throws `invalid_input` if the rows are not full, or for a distance that is negative
/// or NaN. O(N).
export template <PointsSource P>
[[nodiscard]] auto pixel_graph(const P& points, const pixel_graph_options& options,
                               const execution& how = {}) {
  using S = scalar_of<P>;
  constexpr int C = closed_dimension<dimension_of<P>>;
  return closed_pixel_graph<S, C>(points_view<S, C>{points_in(points)}, options, how);
}

/// The number of neighbours of each node.
export template <Scalar S>
[[nodiscard]] std::vector<index_t> degrees(const neighborhoods<S>& graph) {
  std::vector<index_t> all;
  all.reserve(graph.size());
  for (index_t i = 0; i < graph.size(); ++i) all.push_back(static_cast<index_t>(graph[i].size()));
  return all;
}

/// A square sparse matrix, one row per node.
export template <Scalar S>
using graph_matrix = Eigen::SparseMatrix<S, Eigen::RowMajor, std::int32_t>;

/// Throws `invalid_input`, naming the function `who`, unless every neighbour is one of the nodes.
export template <Scalar S>
void expect_nodes(const neighborhoods<S>& graph, const char* who);

/// The neighbours of a node by ascending index, each once and with the smallest of its distances.
template <Scalar S>
void by_index(const neighborhood<S>& near, std::vector<neighbor<S>>& out);
/// Throws `invalid_input` unless `graph` can be a square matrix.
template <Scalar S>
void expect_square(const neighborhoods<S>& graph);

/// The matrix whose entry (i, j) is `evaluate(i, j, distance)` for each neighbour j of i; all other
/// entries are not stored, while an entry that evaluates to 0 is. A neighbour that occurs twice
/// counts once. Throws `invalid_input` for a neighbour that is not a node, and for 2³¹ entries or
/// more.
export template <Scalar S, PairWeight<S> F>
[[nodiscard]] graph_matrix<S> pair_matrix(const neighborhoods<S>& graph, const F& evaluate) {
  expect_square(graph);
  expect_sizes(evaluate, graph.size(), graph.size(), "pair_matrix");
  graph_matrix<S> matrix(graph.size(), graph.size());
  matrix.reserve(graph.total());
  std::vector<neighbor<S>> row;
  for (index_t i = 0; i < graph.size(); ++i) {
    matrix.startVec(i);
    by_index(graph[i], row);
    for (const auto& [j, distance] : row)
      matrix.insertBackByOuterInner(i, j) = static_cast<S>(evaluate_pair(evaluate, i, j, distance));
  }
  matrix.finalize();
  return matrix;
}

/// The matrix with 1 for each edge.
export template <Scalar S>
[[nodiscard]] graph_matrix<S> adjacency_matrix(const neighborhoods<S>& graph) {
  return pair_matrix(graph, unit_weight{});
}

/// The matrix with the distance along each edge; between equal points, a stored 0.
export template <Scalar S>
[[nodiscard]] graph_matrix<S> distance_matrix(const neighborhoods<S>& graph) {
  return pair_matrix(graph, distance_weight{});
}

#define CILANTRO_COMPILED_ELSEWHERE(S, D)                                             \
  extern template neighborhoods<S> closed_edge_graph(                                 \
      points_view<S, D>, const Eigen::Ref<const Eigen::MatrixXi>&, const execution&); \
  extern template neighborhoods<S> closed_pixel_graph(                                \
      points_view<S, D>, const pixel_graph_options&, const execution&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
