// SPDX-License-Identifier: MIT
#include <cstdint>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import clustering_support;
import test_support;

using namespace cilantro;

namespace {

/// Flood fill over all pairs, by the definition.
template <class M, class Connected>
std::vector<std::int32_t> flood(const M& points, Connected connected) {
  std::vector<std::int32_t> labels(std::size_t(points.cols()), -1);
  std::int32_t next = 0;
  for (index_t start = 0; start < points.cols(); ++start) {
    if (labels[std::size_t(start)] >= 0 || !is_finite(points.col(start))) continue;
    std::vector<index_t> open{start};
    labels[std::size_t(start)] = next;
    while (!open.empty()) {
      const index_t i = open.back();
      open.pop_back();
      for (index_t j = 0; j < points.cols(); ++j)
        if (labels[std::size_t(j)] < 0 && is_finite(points.col(j)) && connected(i, j)) {
          labels[std::size_t(j)] = next;
          open.push_back(j);
        }
    }
    ++next;
  }
  return labels;
}

}  // namespace

TEST_CASE_TEMPLATE("components are those of a flood fill, for any number of threads", T,
                   ALL_SPACES) {
  using S = typename T::scalar;
  auto points = test::random_points<T>(400, 3);
  points(0, 17) = test::nan<S>;
  points(0, 30) = test::infinity<S>;
  points.col(50) = points.col(51);
  const double reach = T::dimension == 2 ? 0.07 : T::dimension == 3 ? 0.2 : 0.45;
  const auto right_of = [&](index_t i, index_t j, S) {
    return (points(0, i) > 0) == (points(0, j) > 0);
  };
  const auto expected = flood(points, [&](index_t i, index_t j) {
    return (points.col(i) - points.col(j)).norm() <= S(reach) && right_of(i, j, 0);
  });
  const auto first = connected_components(points, radius{reach}, right_of, {.threads = 1});
  CHECK(test::same_partition(first.labels(), expected));
  CHECK(first.unlabeled() == 2);
  CHECK(first.size() > 3);
  for (const int threads : {2, 5})
    CHECK(connected_components(points, radius{reach}, right_of, {.threads = threads}) == first);

  const kd_tree tree{points};
  CHECK(connected_components(tree, points, radius{reach}, right_of) == first);
  const auto graph = find_neighborhoods(tree, points, radius{reach});
  const auto from_graph = connected_components(graph, right_of);
  // Of a graph alone nobody can say which nodes are not finite: they are on their own.
  CHECK(from_graph.size() == first.size() + 2);
}

TEST_CASE("an edge found from either end connects") {
  // The nearest of point 2 is 1, and that of 1 is 0.
  const std::vector<Eigen::Vector2d> points{{0, 0}, {1, 0}, {3, 0}};
  CHECK(connected_components(points, knn{2}).size() == 1);
  CHECK(connected_components(points, knn{1}).size() == 3);
}

TEST_CASE("smooth parts are found by the angle between normals, also of identical normals") {
  // Two walls of a corner: identical normals within each, at a right angle to the others.
  std::vector<Eigen::Vector3f> points, normals;
  const Eigen::Vector3f up = Eigen::Vector3f{0.3f, 0.2f, 0.9f}.normalized();
  const Eigen::Vector3f side = up.unitOrthogonal();
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 20; ++j) {
      points.push_back(0.1f * (float(i) * side + float(j) * up.cross(side)));
      normals.push_back(up);
      points.push_back(0.1f * (float(i) * up + float(j) * up.cross(side)));
      normals.push_back(side);
    }
  const auto parts = connected_components(points, knn{10}, similar_normals{normals, 0.0});
  CHECK(parts.size() == 2);
  CHECK(parts.sizes() == std::vector<index_t>{400, 400});
  const auto by_hand = connected_components(points, knn{10}, [&](index_t i, index_t j, float) {
    return normals[std::size_t(i)].dot(normals[std::size_t(j)]) > 0.99f;
  });
  CHECK(by_hand == parts);
  CHECK(connected_components(points, knn{10}).size() == 1);
}

TEST_CASE("sizes and seeds choose among the components") {
  std::vector<Eigen::Vector2f> points;
  for (const auto& [x, count] : {std::pair{0.0f, 5}, {10.0f, 3}, {20.0f, 1}})
    for (int i = 0; i < count; ++i) points.emplace_back(x + 0.1f * float(i), 0);
  const auto sizes = [&](const components_options& options) {
    return connected_components(points, radius{0.2}, always_similar{}, options).sizes();
  };
  CHECK(sizes({}) == std::vector<index_t>{5, 3, 1});
  CHECK(sizes({.min_cluster_size = 2}) == std::vector<index_t>{5, 3});
  CHECK(sizes({.min_cluster_size = 2, .max_cluster_size = 3}) == std::vector<index_t>{3});
  CHECK(sizes({.seeds = {{6, 7, 8}}}) == std::vector<index_t>{3, 1});
  CHECK(sizes({.seeds = index_list{}}).empty());
  CHECK_THROWS_AS((void)sizes({.seeds = {{9}}}), invalid_input);
  CHECK_THROWS_AS((void)sizes({.min_cluster_size = -1}), invalid_input);
}

TEST_CASE("no points, one point, equal points and points that are not finite have components") {
  const Eigen::Matrix3Xf nothing(3, 0);
  CHECK(connected_components(nothing, knn{3}).empty());
  const Eigen::Matrix3Xf one = Eigen::Matrix3Xf::Zero(3, 1);
  CHECK(connected_components(one, knn{3}).size() == 1);
  const Eigen::Matrix3Xf equal = Eigen::Matrix3Xf::Ones(3, 40);
  CHECK(connected_components(equal, radius{0}).size() == 1);
  CHECK(connected_components(equal, knn{100}).size() == 1);
  const Eigen::Matrix3Xf bad = Eigen::Matrix3Xf::Constant(3, 4, test::nan<float>);
  CHECK(connected_components(bad, knn{3}).unlabeled() == 4);
  CHECK(connected_components(neighborhoods<double>{}).empty());
  CHECK_THROWS_AS((void)connected_components(neighborhoods<float>{{0, 1}, {7}, {0.5f}}),
                  invalid_input);
}

TEST_CASE("a cloud can be segmented as it is, and the work can be stopped") {
  point_cloud<float, 3> cloud{.points = test::random_points<test::f3>(3000)};
  CHECK(connected_components(cloud, radius{0.5}).size() == 1);
  std::stop_source stop;
  stop.request_stop();
  CHECK_THROWS_AS((void)connected_components(cloud, radius{0.5}, always_similar{},
                                             {.monitor = {.stop = stop.get_token()}}),
                  cancelled);
}

TEST_CASE("a similarity function is tested on what its concept says") {
  const auto points = test::random_points<test::d2>(100);
  const auto graph = neighbor_graph(points, knn{5});
  CHECK(check_similarity_function(close_points{points, 0.3}, graph).empty());
  const auto lopsided = [](index_t i, index_t j, double) { return i < j; };
  CHECK(check_similarity_function(lopsided, graph) ==
        std::vector<std::string>{"the answer for (i, j) is not that for (j, i)"});
}
