// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdint>
#include <cstdlib>
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

TEST_CASE_TEMPLATE("the edges of simplices go both ways, each once, with their lengths", T,
                   ALL_SPACES) {
  using S = typename T::scalar;
  auto points = test::random_points<T>(40, 3);
  points(0, 7) = test::nan<S>;
  // Triangles that share edges, one that is twice there, and one that is hardly one.
  Eigen::Matrix3Xi triangles(3, 40);
  for (int t = 0; t < 38; ++t) triangles.col(t) << t, t + 1, t + 2;
  triangles.col(38) = triangles.col(4);
  triangles.col(39) << 20, 20, 30;
  std::map<std::pair<index_t, index_t>, S> expected;
  for (int t = 0; t < 40; ++t)
    for (const int i : triangles.col(t))
      for (const int j : triangles.col(t))
        if (i != j && i != 7 && j != 7) expected[{i, j}] = (points.col(i) - points.col(j)).norm();
  CHECK(edges_of(edge_graph(points, triangles)) == expected);
  CHECK(edges_of(edge_graph(points, triangles, {.threads = 3})) == expected);

  Eigen::Matrix<int, 2, 1> edge{3, 9};
  CHECK(edges_of(edge_graph(points, edge)).size() == 2);
  CHECK(edge_graph(points, Eigen::Matrix3Xi(3, 0)).total() == 0);
  CHECK_THROWS_AS((void)edge_graph(points, Eigen::MatrixXi::Zero(20, 3)), invalid_input);
  CHECK_THROWS_AS((void)edge_graph(points, Eigen::MatrixXi::Zero(1, 3)), invalid_input);
  for (const int wrong : {-1, 40}) {
    edge[1] = wrong;
    CHECK_THROWS_AS((void)edge_graph(points, edge), invalid_input);
  }
}

TEST_CASE_TEMPLATE("pixels are joined to those around them, but not across a jump", T, ALL_SPACES) {
  using S = typename T::scalar;
  constexpr index_t width = 7, height = 5;
  auto points = test::random_points<T>(width * height, 4);
  points(1, 11) = test::infinity<S>;
  const double most = 1;
  std::map<std::pair<index_t, index_t>, S> all, near;
  for (index_t i = 0; i < points.cols(); ++i)
    for (index_t j = 0; j < points.cols(); ++j) {
      const bool is_beside = std::abs(i % width - j % width) <= 1 &&
                             std::abs(i / width - j / width) <= 1 && i != j && i != 11 && j != 11;
      if (!is_beside) continue;
      const S distance = (points.col(i) - points.col(j)).norm();
      all[{i, j}] = distance;
      if (double(distance) <= most) near[{i, j}] = distance;
    }
  CHECK(near.size() < all.size());
  CHECK(near.size() > 10);
  CHECK(edges_of(pixel_graph(points, {.width = int(width)})) == all);
  CHECK(edges_of(pixel_graph(points, {.width = int(width), .max_distance = most})) == near);
  CHECK(edges_of(pixel_graph(points, {.width = int(width)}, {.threads = 3})) == all);

  CHECK(edges_of(pixel_graph(points, {.width = width * height})).size() == 2 * (34 - 2));
  CHECK_THROWS_AS((void)pixel_graph(points, {}), invalid_input);
  CHECK_THROWS_AS((void)pixel_graph(points, {.width = 6}), invalid_input);
  CHECK_THROWS_AS((void)pixel_graph(points, {.width = 7, .max_distance = -1}), invalid_input);
  CHECK_THROWS_AS((void)pixel_graph(points, {.width = 7, .max_distance = test::nan<double>}),
                  invalid_input);
  CHECK(pixel_graph(points.leftCols(0), {.width = 7}).size() == 0);
}
