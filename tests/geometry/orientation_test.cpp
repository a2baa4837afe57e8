// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdint>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

/// On the unit sphere around `centre`, evenly.
template <class T>
auto sphere(index_t count, std::uint64_t seed) {
  point_matrix<typename T::scalar, T::static_dimension> points(T::dimension, count);
  for (index_t i = 0; i < count; ++i) {
    random_stream random{seed, std::uint64_t(i)};
    for (auto& c : points.col(i)) c = typename T::scalar(random.normal());
    points.col(i).normalize();
  }
  return points;
}

template <class M>
void flip_at_random(M& normals, std::uint64_t seed) {
  random_stream random{seed};
  for (auto n : normals.colwise())
    if (random.below(2) == 0) n = -n;
}

}  // namespace

TEST_CASE_TEMPLATE("the normals of a sphere all point outwards afterwards", T, ALL_SPACES) {
  const auto points = sphere<T>(2000, 1);
  auto normals = points;
  flip_at_random(normals, 2);
  CHECK(orient_consistently(normals, points, knn{10}) == 1);
  CHECK(normals == points);
}

TEST_CASE_TEMPLATE("with a viewpoint, the side towards it", T, test::f3, test::d2) {
  using S = typename T::scalar;
  const auto points = sphere<T>(1000, 3);
  auto normals = points;
  flip_at_random(normals, 4);
  const point_vector<S, T::static_dimension> inside = points.col(0) * S(0.5);
  CHECK(orient_consistently(normals, points, knn{10}, {.viewpoint = coordinates{inside}}) == 1);
  CHECK(normals == -points);
}

TEST_CASE("parts that are not connected are turned apart, and counted") {
  Eigen::Matrix3Xd points(3, 3000);
  points << sphere<test::d3>(1500, 5), sphere<test::d3>(1500, 6);
  Eigen::Matrix3Xd normals = points;
  points.rightCols(1500).array() += 10;
  const Eigen::Matrix3Xd outwards = normals;
  flip_at_random(normals, 7);
  CHECK(orient_consistently(normals, points, radius{0.4}) == 2);
  CHECK(normals == outwards);
}

TEST_CASE("estimated normals of a box agree on each side, over its edges") {
  random_stream random{8};
  Eigen::Matrix3Xd points(3, 12000), outwards = Eigen::Matrix3Xd::Zero(3, 12000);
  for (index_t i = 0; i < points.cols(); ++i) {
    for (auto& c : points.col(i)) c = random.uniform(-1, 1);
    const index_t axis = random.below(3);
    const double side = random.below(2) == 0 ? -1 : 1;
    points(axis, i) = side;
    outwards(axis, i) = side;
  }
  auto normals = estimate_normals(points, knn{12}).normals;
  CHECK(orient_consistently(normals, points, knn{12}) == 1);
  for (index_t i = 0; i < points.cols(); ++i) CHECK(normals.col(i).dot(outwards.col(i)) > -0.1);
}

TEST_CASE("unknown normals stay unknown, and nothing is turned where nothing is known") {
  Eigen::Matrix3Xf points = test::random_points<test::f3>(100, 9);
  points(0, 3) = test::nan<float>;
  Eigen::Matrix3Xf normals = Eigen::Matrix3Xf::Zero(3, 100);
  CHECK(orient_consistently(normals, points, knn{5}) == 0);
  CHECK(normals.isZero(0));
  normals.col(50) << 0, 0, -1;
  CHECK(orient_consistently(normals, points, knn{5}) == 1);
  CHECK(normals.col(50) == Eigen::Vector3f::UnitZ());
  Eigen::Matrix3Xf none(3, 0);
  CHECK(orient_consistently(none, Eigen::Matrix3Xf(3, 0), knn{5}) == 0);
  CHECK_THROWS_AS(orient_consistently(none, points, knn{5}), invalid_input);
  CHECK_THROWS_AS(orient_consistently(normals, points, neighborhoods<float>{}), invalid_input);
}
