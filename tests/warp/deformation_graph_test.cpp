// SPDX-License-Identifier: MIT
//
// Which nodes move which points, and how much.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

/// The weights of the nodes nearest to a point, from their definition.
template <class P, class N>
std::vector<std::pair<std::int32_t, double>> weights_by_definition(const P& p, const N& nodes,
                                                                   std::size_t count) {
  std::vector<std::pair<double, std::int32_t>> near;
  for (std::int32_t k = 0; k < nodes.cols(); ++k)
    near.emplace_back((nodes.col(k) - p).template cast<double>().norm(), k);
  std::ranges::sort(near);
  const double end = near[count].first;
  std::vector<std::pair<std::int32_t, double>> weights;
  double sum = 0;
  for (std::size_t k = 0; k < count; ++k) {
    weights.emplace_back(near[k].second, std::pow(1 - near[k].first / end, 2));
    sum += weights.back().second;
  }
  for (auto& [node, weight] : weights) weight /= sum;
  std::ranges::sort(weights);
  return weights;
}

}  // namespace

TEST_CASE_TEMPLATE("a point is moved by the nodes nearest to it, with weights that fade out", T,
                   ALL_SPACES) {
  using S = typename T::scalar;
  const auto points = test::random_points<T>(200, 1);
  const auto nodes = test::random_points<T>(20, 2);
  const deformation_graph graph{points, nodes_at{nodes}, {.anchors = 3, .links = knn{4}}};
  REQUIRE(graph.size() == 200);
  REQUIRE(graph.nodes().size() == 20);
  for (index_t i = 0; i < graph.size(); ++i) {
    const auto wanted = weights_by_definition(points.col(i), nodes, 3);
    REQUIRE(graph.anchors(i).size() == 3);
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(graph.anchors(i)[k] == wanted[k].first);
      CHECK(graph.weights(i)[k] ==
            doctest::Approx(wanted[k].second).epsilon(sizeof(S) == 4 ? 1e-4 : 1e-9));
    }
  }
  // A link joins nodes of which one is among the four nearest of the other.
  for (const auto& [a, b] : graph.links()) {
    CHECK(a < b);
    const auto rank = [&](index_t from, index_t to) {
      const auto length = (nodes.col(from) - nodes.col(to)).norm();
      index_t nearer = 0;
      for (index_t k = 0; k < nodes.cols(); ++k)
        nearer += k != from && (nodes.col(from) - nodes.col(k)).norm() < length;
      return nearer;
    };
    CHECK(std::min(rank(a, b), rank(b, a)) < 4);
  }
}

TEST_CASE("nodes by spacing are means of cells that move with the points") {
  const auto points = test::random_points<test::d3>(5000, 3);
  const deformation_graph here{points, {.spacing = 0.3}};
  const Eigen::Matrix3Xd shifted = points.colwise() + Eigen::Vector3d{1e5, -2e5, 3e5};
  const deformation_graph there{shifted, {.spacing = 0.3}};
  REQUIRE(here.nodes().size() == there.nodes().size());
  CHECK(here.nodes().size() > 100);
  CHECK(here.nodes().size() < 600);
  for (index_t i = 0; i < here.size(); ++i)
    for (std::size_t k = 0; k < here.anchors(i).size(); ++k) {
      REQUIRE(here.anchors(i)[k] == there.anchors(i)[k]);
      REQUIRE(std::abs(here.weights(i)[k] - there.weights(i)[k]) < 1e-8);
    }
}

TEST_CASE("what is degenerate has the anchors that there are") {
  Eigen::Matrix3Xd points = test::random_points<test::d3>(50, 4);
  points(1, 7) = test::nan<double>;
  points(2, 8) = test::infinity<double>;
  const deformation_graph one{points, {.spacing = 100}};
  CHECK(one.nodes().size() == 1);
  CHECK(one.links().empty());
  CHECK(one.anchors(7).empty());
  CHECK(one.anchors(8).empty());
  CHECK(one.weights(7).empty());
  REQUIRE(one.anchors(0).size() == 1);
  CHECK(one.weights(0)[0] == 1);
  // Fewer nodes than anchors: all of them.
  const Eigen::Matrix3Xd two = points.leftCols(2);
  const deformation_graph few{points, nodes_at{two}};
  CHECK(few.anchors(0).size() == 2);
  CHECK(few.weights(0)[0] > few.weights(0)[1]);
  // Equal points, as nodes and as points.
  const Eigen::Matrix3Xd equal = Eigen::Vector3d{1, 2, 3}.replicate(1, 10);
  const deformation_graph same{equal, nodes_at{equal}};
  REQUIRE(same.anchors(3).size() == 4);
  for (const double weight : same.weights(3)) CHECK(weight == 0.25);
  // No points at all, or none that is finite.
  const Eigen::Matrix3Xd none(3, 0);
  CHECK(deformation_graph{none, {.spacing = 1}}.nodes().empty());
  const Eigen::Matrix3Xd lost = Eigen::Matrix3Xd::Constant(3, 4, test::nan<double>);
  const deformation_graph nowhere{lost, {.spacing = 1}};
  CHECK(nowhere.nodes().empty());
  CHECK(nowhere.anchors(2).empty());
  CHECK(nowhere.size() == 4);
}

TEST_CASE("every point can be a node") {
  const auto points = test::random_points<test::f3>(100, 5);
  const deformation_graph graph{points, nodes_at{points}, {.anchors = 1}};
  CHECK(graph.nodes().size() == 100);
  for (index_t i = 0; i < 100; ++i) {
    REQUIRE(graph.anchors(i).size() == 1);
    CHECK(graph.anchors(i)[0] == i);
    CHECK(graph.weights(i)[0] == 1);
  }
}

TEST_CASE("parts that touch but are not connected have nodes of their own") {
  // Two sheets, a tenth of the spacing apart.
  Eigen::Matrix3Xd points(3, 800);
  for (index_t i = 0; i < 800; ++i)
    points.col(i) << 0.05 * double(i % 20), 0.05 * double(i / 20 % 20), i < 400 ? 0 : 0.02;
  const auto connections = neighbor_graph(points, radius{0.08});
  std::vector<index_t> offsets{0};
  buffer<std::int32_t> indices;
  buffer<double> distances;
  for (index_t i = 0; i < 800; ++i) {
    for (const auto& [j, distance] : connections[i])
      if ((i < 400) == (j < 400)) {
        indices.push_back(static_cast<std::int32_t>(j));
        distances.push_back(distance);
      }
    offsets.push_back(std::ssize(indices));
  }
  const neighborhoods<double> within{offsets, indices, distances};
  const deformation_graph graph{points, within, {.spacing = 0.2}};
  CHECK(graph.nodes().size() > 20);
  for (index_t i = 0; i < 800; ++i) {
    CHECK(!graph.anchors(i).empty());
    for (const auto node : graph.anchors(i)) CHECK((graph.nodes()[node].z() < 0.01) == (i < 400));
  }
  for (const auto& [a, b] : graph.links())
    CHECK((graph.nodes()[a].z() < 0.01) == (graph.nodes()[b].z() < 0.01));
  // By distance in space, they would share nodes.
  const deformation_graph mixed{points, {.spacing = 0.2}};
  bool is_shared = false;
  for (const auto node : mixed.anchors(0))
    for (const auto other : mixed.anchors(400)) is_shared |= node == other;
  CHECK(is_shared);
}

TEST_CASE("connections of points that are not finite do not count") {
  Eigen::Matrix2Xd line = Eigen::Matrix2Xd::Zero(2, 30);
  line.row(0).setLinSpaced(0, 2.9);
  line(1, 15) = test::nan<double>;
  std::vector<index_t> offsets{0};
  buffer<std::int32_t> indices;
  buffer<double> distances;
  const auto connections_of = [&](double length) {
    offsets = {0};
    indices.clear();
    distances.clear();
    for (std::int32_t i = 0; i < 30; ++i) {
      if (i < 29) {
        indices.push_back(i + 1);
        distances.push_back(i == 14 || i == 15 ? test::nan<double> : length);
      }
      offsets.push_back(std::ssize(indices));
    }
    return neighborhoods<double>{offsets, indices, distances};
  };
  const deformation_graph graph{line, connections_of(0.1), {.spacing = 0.5}};
  CHECK(graph.anchors(15).empty());
  for (index_t i = 0; i < 30; ++i)
    for (const auto node : graph.anchors(i)) CHECK((graph.nodes()[node].x() < 1.5) == (i < 15));
  CHECK_THROWS_AS((deformation_graph{line, connections_of(-1), {.spacing = 0.5}}), invalid_input);
  CHECK_THROWS_AS((deformation_graph{line, connections_of(test::nan<double>), {.spacing = 0.5}}),
                  invalid_input);
}

TEST_CASE("graphs refuse options that make no sense") {
  const auto points = test::random_points<test::d2>(10, 6);
  CHECK_THROWS_AS((deformation_graph{points, {}}), invalid_input);
  CHECK_THROWS_AS((deformation_graph{points, {.spacing = -1}}), invalid_input);
  CHECK_THROWS_AS((deformation_graph{points, {.spacing = test::infinity<double>}}), invalid_input);
  CHECK_THROWS_AS((deformation_graph{points, {.spacing = 1, .anchors = 0}}), invalid_input);
  CHECK_THROWS_AS((deformation_graph{points, {.spacing = 1, .anchors = 17}}), invalid_input);
  CHECK_THROWS_AS((deformation_graph{points, nodes_at{points}, {.spacing = 1}}), invalid_input);
  const Eigen::MatrixXd five(5, 0), three = Eigen::MatrixXd::Zero(3, 9);
  CHECK_THROWS_AS((deformation_graph{five, nodes_at{three}}), invalid_input);
  const neighborhoods<double> none;
  CHECK_THROWS_AS((deformation_graph{points, none, {.spacing = 1}}), invalid_input);
  point_cloud<double, 2> far{.points = points};
  far.origin = Eigen::Vector2d{1000, 0};
  CHECK_THROWS_AS((deformation_graph{far, {.spacing = 1}}), invalid_input);
}
