// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

/// Edges and their distances, from a search by brute force.
template <class M>
auto edges_by_hand(const M& points, neighborhood_spec spec, graph_symmetry symmetry, bool self) {
  const brute_force_searcher searcher{points};
  std::map<std::pair<index_t, index_t>, typename M::Scalar> found, edges;
  std::vector<neighbor<typename M::Scalar>> near;
  for (index_t i = 0; i < points.cols(); ++i) {
    searcher.find(points.col(i), spec, near);
    for (const auto& n : near) found[{i, n.index}] = n.distance;
  }
  for (const auto& [edge, distance] : found) {
    const auto [i, j] = edge;
    if (i == j) {
      if (self) edges[edge] = 0;
      continue;
    }
    const bool back = found.contains({j, i});
    if (symmetry == graph_symmetry::both && !back) continue;
    edges[edge] = distance;
    if (symmetry == graph_symmetry::either) edges[{j, i}] = distance;
  }
  return edges;
}

template <class S>
auto edges_of(const neighborhoods<S>& graph) {
  std::map<std::pair<index_t, index_t>, S> edges;
  for (index_t i = 0; i < graph.size(); ++i) {
    S before = 0;
    for (const auto& n : graph[i]) {
      CHECK(before <= n.distance);
      before = n.distance;
      CHECK(edges.emplace(std::pair{i, n.index}, n.distance).second);
    }
  }
  return edges;
}

}  // namespace

TEST_CASE_TEMPLATE("a graph has the edges that were found, their union or their intersection", T,
                   ALL_SPACES) {
  auto points = test::random_points<T>(150, 1);
  points(0, 9) = test::nan<typename T::scalar>;
  for (const auto symmetry : {graph_symmetry::none, graph_symmetry::either, graph_symmetry::both})
    for (const neighborhood_spec& spec : {neighborhood_spec{knn{6}}, {radius{0.4}}}) {
      CHECK(edges_of(neighbor_graph(points, spec, {.symmetry = symmetry, .self = true})) ==
            edges_by_hand(points, spec, symmetry, true));
      const bool others = spec.is_count_limited();
      const auto asked = others ? neighborhood_spec{knn{5}} : spec;
      CHECK(edges_of(neighbor_graph(points, asked, {.symmetry = symmetry})) ==
            edges_by_hand(points, spec, symmetry, false));
    }
}

TEST_CASE("k neighbors are k others, even among points that are all equal") {
  const Eigen::Matrix2Xf points = Eigen::Matrix2Xf::Zero(2, 30);
  const auto graph = neighbor_graph(points, knn{4}, {.symmetry = graph_symmetry::none});
  for (index_t i = 0; i < 30; ++i) {
    CHECK(graph[i].size() == 4);
    for (const auto& n : graph[i]) CHECK(n.index != i);
  }
  CHECK(degrees(graph) == std::vector<index_t>(30, 4));
}

TEST_CASE_TEMPLATE("a graph is the same for any number of threads", T, test::f3, test::dx) {
  const auto points = test::random_points<T>(2000, 2);
  const auto one = neighbor_graph(points, knn{7}, {.threads = 1});
  for (const int threads : {2, 5}) {
    const auto other = neighbor_graph(points, knn{7}, {.threads = threads});
    CHECK(std::ranges::equal(one.indices(), other.indices()));
    CHECK(std::ranges::equal(one.distances(), other.distances()));
    CHECK(std::ranges::equal(one.offsets(), other.offsets()));
  }
}

// The first cilantro summed the two directions of an edge in its sparse matrices.
TEST_CASE_TEMPLATE("matrices hold each edge once, and nothing is summed", T, ALL_SPACES) {
  using S = typename T::scalar;
  const auto points = test::random_points<T>(80, 3);
  const auto graph = neighbor_graph(points, knn{5});
  const auto edges = edges_of(graph);
  const auto expect = [&](const graph_matrix<S>& matrix, auto entry) {
    CHECK(matrix.nonZeros() == std::ssize(edges));
    for (const auto& [edge, distance] : edges)
      CHECK(matrix.coeff(edge.first, edge.second) == entry(edge.first, edge.second, distance));
  };
  expect(adjacency_matrix(graph), [](index_t, index_t, S) { return S(1); });
  expect(distance_matrix(graph), [](index_t, index_t, S d) { return d; });
  expect(pair_matrix(graph, gaussian{.sigma = 0.3}),
         [](index_t, index_t, S d) { return gaussian{.sigma = 0.3}(d); });
  const auto by_index = [](index_t i, index_t j, S) { return S(1000 * i + j); };
  expect(pair_matrix(graph, by_index), by_index);
  const Eigen::SparseMatrix<S> symmetric = adjacency_matrix(graph);
  CHECK((Eigen::MatrixX<S>{symmetric} == Eigen::MatrixX<S>{symmetric}.transpose()));
}

TEST_CASE("neighbors that come twice count once, with the smaller distance") {
  const neighborhoods<float> twice{{0, 3, 4}, {1, 1, 0, 0}, {5, 2, 0, 1}};
  const auto matrix = distance_matrix(twice);
  CHECK(matrix.nonZeros() == 3);
  CHECK(matrix.coeff(0, 1) == 2);
  const auto graph = neighbor_graph(twice);
  CHECK(edges_of(graph) == std::map<std::pair<index_t, index_t>, float>{{{0, 1}, 1}, {{1, 0}, 1}});
}

TEST_CASE("equal points have an edge of stored 0") {
  const Eigen::Matrix2Xf points = Eigen::Matrix2Xf::Ones(2, 2);
  const auto matrix = distance_matrix(neighbor_graph(points, knn{1}));
  CHECK(matrix.nonZeros() == 2);
  CHECK(matrix.coeff(0, 1) == 0);
}

TEST_CASE("graphs of nothing are empty, and foreign neighbors are refused") {
  CHECK(neighbor_graph(Eigen::Matrix3Xd(3, 0), knn{3}).size() == 0);
  CHECK(adjacency_matrix(neighborhoods<double>{}).size() == 0);
  const neighborhoods<float> foreign{{0, 1}, {4}, {1}};
  CHECK_THROWS_AS((void)neighbor_graph(foreign), invalid_input);
  CHECK_THROWS_AS((void)adjacency_matrix(foreign), invalid_input);
  const auto points = test::random_points<test::f2>(9);
  const kd_tree tree{points.leftCols(5)};
  CHECK_THROWS_AS((void)neighbor_graph(tree, points, knn{2}), invalid_input);
}
