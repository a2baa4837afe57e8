// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stop_token>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

template <class M>
Eigen::MatrixXd distances_of(const M& points) {
  Eigen::MatrixXd d(points.cols(), points.cols());
  for (index_t i = 0; i < d.cols(); ++i)
    for (index_t j = 0; j < d.cols(); ++j) d(i, j) = double((points.col(i) - points.col(j)).norm());
  return d;
}

/// A sheet of paper of 4 by 2 that is rolled up.
Eigen::Matrix3Xd rolled(index_t n, Eigen::Matrix2Xd& flat) {
  Eigen::Matrix3Xd points(3, n);
  flat.resize(2, n);
  random_stream random{3};
  for (index_t i = 0; i < n; ++i) {
    const double along = random.uniform(0, 4), across = random.uniform(0, 2);
    flat.col(i) << along, across;
    points.col(i) << std::cos(along), across, std::sin(along);
  }
  return points;
}

}  // namespace

TEST_CASE_TEMPLATE("points are rebuilt from their distances, whatever their dimension", T,
                   ALL_SPACES) {
  for (const index_t n : {40, 500}) {
    const auto points = test::random_points<T>(n, 2);
    const Eigen::MatrixXd d = distances_of(points);
    const auto found = multidimensional_scaling(d, {.dimension = T::dimension});
    REQUIRE(found.converged);
    REQUIRE(found.points.rows() == T::dimension);
    CHECK((distances_of(found.points) - d).cwiseAbs().maxCoeff() <
          (sizeof(typename T::scalar) == 4 ? 1e-4 : 1e-7));
    CHECK(found.explained == doctest::Approx(1).epsilon(1e-6));
    CHECK(found.points.rowwise().mean().norm() < 1e-7);
    const auto squared =
        multidimensional_scaling(d.cwiseAbs2(), {.dimension = 2}, distance_form::squared);
    CHECK((squared.points - found.points.topRows(2)).norm() < 1e-5);
    // All of it is in so many dimensions, and no more than these are embedded.
    CHECK(multidimensional_scaling(d, {.explained = 0.999999}).points.rows() == T::dimension);
    CHECK(multidimensional_scaling(d, {.dimension = T::dimension + 3}).points.rows() >=
          T::dimension);
    for (const int threads : {1, 2, 5})
      CHECK(multidimensional_scaling(d, {.dimension = 2, .threads = threads}).points ==
            multidimensional_scaling(d, {.dimension = 2}).points);
  }
}

TEST_CASE("the gap of the eigenvalues says how many coordinates there are") {
  Eigen::MatrixXd points = Eigen::MatrixXd::Zero(6, 400);
  points.topRows(3) = test::random_points<test::d3>(400);
  points.bottomRows(3) = 0.01 * test::random_points<test::d3>(400, 1);
  const auto found = multidimensional_scaling(distances_of(points));
  CHECK(found.points.rows() == 3);
  CHECK(found.eigenvalues.size() == 11);
  CHECK(found.explained > 0.999);
  CHECK(multidimensional_scaling(distances_of(points), {.explained = 0.5}).points.rows() == 2);
  CHECK(multidimensional_scaling(distances_of(points), {.max_dimension = 2}).points.rows() <= 2);
}

TEST_CASE("negative eigenvalues are reported and never embedded") {
  // No points have these distances: the fourth is too near to three that are far apart.
  Eigen::MatrixXd d(4, 4);
  d << 0, 2, 2, 1,  //
      2, 0, 2, 1,   //
      2, 2, 0, 1,   //
      1, 1, 1, 0;
  const auto found = multidimensional_scaling(d, {.dimension = 4});
  CHECK(found.points.rows() == 2);
  REQUIRE(found.smallest_eigenvalue);
  CHECK(*found.smallest_eigenvalue < -0.1);
  CHECK(found.eigenvalues.size() == 4);
  CHECK(found.explained < 1);
  // Of many points, too: distances that grow with the fourth power are far from Euclidean.
  const Eigen::MatrixXd large = distances_of(test::random_points<test::d2>(400)).array().pow(4);
  const auto many = multidimensional_scaling(large, {.dimension = 10});
  REQUIRE(many.converged);
  REQUIRE(many.smallest_eigenvalue);
  CHECK(*many.smallest_eigenvalue < -1);
  CHECK(many.points.allFinite());
}

TEST_CASE("equal distances, which have no leading direction, are embedded all the same") {
  for (const index_t n : {10, 400}) {
    const Eigen::MatrixXd d = Eigen::MatrixXd::Ones(n, n) - Eigen::MatrixXd::Identity(n, n);
    const auto found = multidimensional_scaling(d, {.dimension = 3});
    REQUIRE(found.converged);
    CHECK(found.points.rows() == 3);
    for (index_t k = 0; k < 3; ++k) CHECK(found.eigenvalues[k] == doctest::Approx(0.5));
  }
}

TEST_CASE("distances of nothing, of one point, and of equal points") {
  CHECK(multidimensional_scaling(Eigen::MatrixXd(0, 0)).points.cols() == 0);
  CHECK(multidimensional_scaling(Eigen::MatrixXd::Zero(1, 1)).points.cols() == 1);
  const auto equal = multidimensional_scaling(Eigen::MatrixXd::Zero(5, 5));
  CHECK(equal.points.rows() == 0);
  CHECK(equal.points.cols() == 5);
  CHECK(equal.explained == 1);
}

TEST_CASE("what are no distances is refused") {
  Eigen::MatrixXd d = distances_of(test::random_points<test::d2>(5));
  const auto broken = [&](index_t i, index_t j, double value) {
    Eigen::MatrixXd other = d;
    other(i, j) = value;
    CHECK_THROWS_AS((void)multidimensional_scaling(other), invalid_input);
  };
  broken(1, 2, d(1, 2) + 0.1);
  broken(2, 2, 0.1);
  broken(0, 1, test::nan<double>);
  broken(0, 1, -1);
  CHECK_THROWS_AS((void)multidimensional_scaling(d.leftCols(3)), invalid_input);
  CHECK_THROWS_AS((void)multidimensional_scaling(d, {.dimension = -1}), invalid_input);
  CHECK_THROWS_AS((void)multidimensional_scaling(d, {.explained = 1.5}), invalid_input);
}

TEST_CASE_TEMPLATE("shortest paths are those of Floyd and Warshall", T, test::f2, test::d3,
                   test::dx) {
  const auto points = test::random_points<T>(80, 2);
  for (const auto symmetry : {graph_symmetry::either, graph_symmetry::none}) {
    const auto graph = neighbor_graph(points, knn{4}, {.symmetry = symmetry});
    Eigen::MatrixXd expected = Eigen::MatrixXd::Constant(80, 80, test::infinity<double>);
    for (index_t i = 0; i < 80; ++i) {
      expected(i, i) = 0;
      for (const auto& [j, distance] : graph[i]) expected(j, i) = double(distance);
    }
    for (index_t k = 0; k < 80; ++k)
      for (index_t i = 0; i < 80; ++i)
        for (index_t j = 0; j < 80; ++j)
          expected(j, i) = std::min(expected(j, i), expected(k, i) + expected(j, k));
    const auto found = shortest_paths(graph);
    for (index_t i = 0; i < 80; ++i)
      for (index_t j = 0; j < 80; ++j)
        CHECK((found(j, i) == expected(j, i) || std::abs(found(j, i) - expected(j, i)) < 1e-5));
    CHECK(shortest_paths(graph, {.threads = 5}) == shortest_paths(graph, {.threads = 1}));
  }
  CHECK_THROWS_AS((void)shortest_paths(neighborhoods<float>{{0, 1}, {3}, {1}}), invalid_input);
  CHECK_THROWS_AS((void)shortest_paths(neighborhoods<float>{{0, 1}, {0}, {-1}}), invalid_input);
}

TEST_CASE("a rolled sheet is flat again") {
  Eigen::Matrix2Xd flat;
  const auto points = rolled(900, flat);
  const auto found = isomap(points, knn{10}, {.dimension = 2});
  REQUIRE(found.converged);
  CHECK(found.components == 1);
  CHECK(found.kept.size() == 900);
  // Up to a motion, and to the detours of paths: by how well the coordinates go together.
  const auto correlation = [](const Eigen::RowVectorXd& a, const Eigen::RowVectorXd& b) {
    const Eigen::RowVectorXd x = a.array() - a.mean(), y = b.array() - b.mean();
    return std::abs(x.dot(y)) / (x.norm() * y.norm());
  };
  CHECK(correlation(found.points.row(0), flat.row(0)) > 0.995);
  CHECK(correlation(found.points.row(1), flat.row(1)) > 0.98);
  // A straight line does not see that: the plain distances need three dimensions.
  CHECK(multidimensional_scaling(distances_of(points), {.explained = 0.99}).points.rows() == 3);
}

TEST_CASE("of a graph in parts the largest is embedded, and the others are named") {
  Eigen::Matrix2Xf points = test::random_points<test::f2>(100);
  points.col(3).array() += 100;
  points.col(7).array() += 100;
  points(0, 50) = test::nan<float>;
  const auto found = isomap(points, radius{1.0}, {.dimension = 2});
  CHECK(found.components >= 2);
  CHECK(found.kept.size() == 97);
  CHECK(found.points.cols() == 97);
  for (const index_t lost : {3, 7, 50}) CHECK(!std::ranges::binary_search(found.kept, lost));
  CHECK(isomap(Eigen::Matrix2Xf(2, 0), knn{3}).kept.empty());
  CHECK(isomap(neighborhoods<double>{}).kept.empty());
  const point_cloud<double, 3> cloud{.points = test::random_points<test::d3>(50)};
  CHECK(isomap(cloud, knn{8}).kept.size() == 50);
  const Eigen::Matrix2Xf many = Eigen::Matrix2Xf::Zero(2, most_isomap_points + 1);
  CHECK_THROWS_AS((void)isomap(many, knn{2}), invalid_input);
  std::stop_source stop;
  stop.request_stop();
  CHECK_THROWS_AS((void)isomap(cloud, knn{8}, {.monitor = {.stop = stop.get_token()}}), cancelled);
}
