// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "spaces.hpp"

import cilantro;
import registration_support;
import test_support;

using namespace cilantro;

namespace {

/// Points on the surface of a unit cube.
Eigen::Matrix3Xd cube(index_t count) {
  Eigen::Matrix3Xd points = test::random_points<test::d3>(count, 4, 0, 1);
  for (index_t i = 0; i < count; ++i) points(i % 3, i) = double(i / 3 % 2);
  return points;
}

/// By the definition.
index_list plain_keypoints(const Eigen::MatrixXd& points, double radius, double suppression,
                           double most_alike) {
  const index_t n = points.cols();
  std::vector<double> salient(n);
  const auto near = [&](index_t i, index_t j, double distance) {
    return (points.col(i) - points.col(j)).norm() <= distance;
  };
  for (index_t i = 0; i < n; ++i) {
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(points.rows());
    Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(points.rows(), points.rows());
    double count = 0;
    for (index_t j = 0; j < n; ++j)
      if (near(i, j, radius)) mean += points.col(j), ++count;
    if (count < 5) continue;
    mean /= count;
    for (index_t j = 0; j < n; ++j)
      if (near(i, j, radius)) spread += (points.col(j) - mean) * (points.col(j) - mean).transpose();
    const auto values = decompose_symmetric<dynamic>(spread / (count - 1)).values;
    bool differs = true;
    for (index_t d = 1; d < values.size(); ++d)
      differs = differs && values[d - 1] <= most_alike * values[d];
    if (differs) salient[i] = values[0];
  }
  index_list kept;
  for (index_t i = 0; i < n; ++i) {
    bool best = salient[i] > 0;
    for (index_t j = 0; j < n; ++j)
      if (near(i, j, suppression))
        best = best && (salient[j] < salient[i] || (salient[j] == salient[i] && j >= i));
    if (best) kept.push_back(std::int32_t(i));
  }
  return kept;
}

}  // namespace

TEST_CASE_TEMPLATE("keypoints are those that the definition names", Space, test::d2, test::d3,
                   test::dx) {
  const auto points = test::random_points<Space>(400, 8);
  const Eigen::MatrixXd plain = points.template cast<double>();
  for (const double most_alike : {0.975, 0.6})
    CHECK(iss_keypoints(points, {.radius = 0.4, .suppression = 0.3, .most_alike = most_alike}) ==
          plain_keypoints(plain, 0.4, 0.3, most_alike));
}

TEST_CASE("the corners of a cube are keypoints, and its faces are not") {
  const auto points = cube(6000);
  const auto found = iss_keypoints(points, {.radius = 0.2});
  CHECK(found.size() >= 8);
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d place{double(corner & 1), double(corner >> 1 & 1),
                                double(corner >> 2 & 1)};
    CHECK(
        std::ranges::any_of(found, [&](auto i) { return (points.col(i) - place).norm() < 0.25; }));
  }
  for (const auto i : found) {
    // Near an edge: at least two coordinates are near 0 or 1.
    int near = 0;
    for (int d = 0; d < 3; ++d) near += std::min(points(d, i), 1 - points(d, i)) <= 0.2;
    CHECK(near >= 2);
  }
}

TEST_CASE("keypoints of odd sets, and wrong options") {
  CHECK(iss_keypoints(Eigen::Matrix3Xf(3, 0), {.radius = 1}).empty());
  CHECK(iss_keypoints(Eigen::Matrix3Xf::Ones(3, 1).eval(), {.radius = 1}).empty());
  CHECK(iss_keypoints(Eigen::Matrix3Xf::Ones(3, 50).eval(), {.radius = 1}).empty());
  Eigen::Matrix3Xf some = cube(3000).cast<float>();
  const auto before = iss_keypoints(some, {.radius = 0.2});
  some.conservativeResize(3, 3001);
  some.col(3000).setConstant(test::nan<float>);
  CHECK(iss_keypoints(some, {.radius = 0.2}) == before);
  CHECK(iss_keypoints(some, {.radius = 0.2, .threads = 4}) == before);
  CHECK_THROWS_AS((void)iss_keypoints(some, {}), invalid_input);
  CHECK_THROWS_AS((void)iss_keypoints(some, {.radius = -1}), invalid_input);
  CHECK_THROWS_AS((void)iss_keypoints(some, {.radius = 1, .suppression = -1}), invalid_input);
  CHECK_THROWS_AS((void)iss_keypoints(some, {.radius = 1, .most_alike = 0}), invalid_input);
  CHECK_THROWS_AS((void)iss_keypoints(some, {.radius = 1, .min_neighbors = -1}), invalid_input);
}
