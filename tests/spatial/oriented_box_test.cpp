// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include <doctest/doctest.h>

#include "spaces.hpp"
import cilantro;
import test_support;

using namespace cilantro;

namespace {

/// The least volume of a box about the points with one of many axes, turned in small steps.
double volume_by_trying(const Eigen::Matrix3Xd& points, int steps) {
  random_stream random{11};
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < steps; ++i) {
    Eigen::Vector4d q;
    for (int k = 0; k < 4; ++k) q[k] = random.normal();
    const Eigen::Matrix3d turn = Eigen::Quaterniond{q.normalized()}.toRotationMatrix();
    const Eigen::Matrix3Xd turned = turn * points;
    least = std::min(least, (turned.rowwise().maxCoeff() - turned.rowwise().minCoeff()).prod());
  }
  return least;
}

}  // namespace

TEST_CASE_TEMPLATE("a turned box is found again, with all points inside", T, test::f2, test::d2,
                   test::f3, test::d3) {
  using S = typename T::scalar;
  constexpr int D = T::dimension;
  const auto sides =
      D == 2 ? Eigen::VectorXd{Eigen::Vector2d{3, 1}} : Eigen::VectorXd{Eigen::Vector3d{3, 2, 1}};
  Eigen::MatrixXd turn(D, D);
  if constexpr (D == 2)
    turn << std::cos(0.4), -std::sin(0.4), std::sin(0.4), std::cos(0.4);
  else
    turn = Eigen::AngleAxisd{0.8, Eigen::Vector3d{1, -2, 0.5}.normalized()}.toRotationMatrix();
  point_matrix<S, D> points(D, (1 << D) + 200);
  const auto inner = test::random_points<test::space<double, D>>(200, 3, -0.49, 0.49);
  for (index_t i = 0; i < points.cols(); ++i) {
    Eigen::VectorXd place(D);
    for (int d = 0; d < D; ++d)
      place[d] =
          sides[d] * (i < (1 << D) ? ((i >> d & 1) != 0 ? 0.5 : -0.5) : inner(d, i - (1 << D)));
    points.col(i) = (turn * place).template cast<S>().array() + S(10);
  }
  const auto found = minimum_volume_box(points);
  REQUIRE(found);
  CHECK(found->volume() == doctest::Approx(sides.prod()).epsilon(1e-5));
  CHECK((2 * found->half_extents - sides).norm() < 1e-4);
  CHECK((found->axes.transpose() * found->axes - Eigen::MatrixXd::Identity(D, D)).norm() < 1e-12);
  CHECK(determinant(found->axes) == doctest::Approx(1));
  for (index_t i = 0; i < points.cols(); ++i) CHECK(found->contains(points.col(i)));
  CHECK(convex_hull(found->corners()).volume() == doctest::Approx(found->volume()));
  // As a region.
  point_cloud<S, D> cloud{.points = points};
  cloud.points.col(0).setConstant(S(100));
  CHECK((cloud | crop(*found)).size() == points.cols() - 1);
}

TEST_CASE("a regular tetrahedron fits into the cube of whose faces its edges are diagonals") {
  Eigen::Matrix3Xd corners(3, 4);
  corners << 0, 1, 1, 0, 0, 1, 0, 1, 0, 0, 1, 1;
  CHECK(minimum_volume_box(corners)->volume() == doctest::Approx(1).epsilon(1e-9));
}

TEST_CASE("no box in any of 20,000 directions is smaller") {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    const Eigen::Matrix3Xd points = test::random_points<test::d3>(12, seed);
    CHECK(minimum_volume_box(points)->volume() <= volume_by_trying(points, 20'000));
  }
}

TEST_CASE("boxes about huge and tiny points, and ones as far apart as doubles go") {
  const Eigen::Matrix3Xd points = test::random_points<test::d3>(20, 7);
  const Eigen::VectorXd sides = minimum_volume_box(points)->half_extents;
  for (const double scale : {1e-280, 1e-110, 1e105, 1e300}) {
    const Eigen::Matrix3Xd sized = points * scale;
    const auto found = minimum_volume_box(sized);
    CHECK((found->half_extents / scale - sides).norm() < 1e-9);
    for (index_t i = 0; i < sized.cols(); ++i) CHECK(found->contains(sized.col(i)));
  }
  const Eigen::Matrix2Xd too_far{{-1e307, 1e307, 0}, {0, 0, 1e307}};
  const auto found = minimum_volume_box(too_far);
  for (index_t i = 0; i < 3; ++i) CHECK(found->contains(too_far.col(i)));
}

TEST_CASE("boxes about flat sets, few points and none") {
  CHECK_FALSE(minimum_volume_box(Eigen::Matrix3Xd(3, 0)));
  const auto one = minimum_volume_box(Eigen::Matrix3Xd{Eigen::Vector3d{1, 2, 3}});
  REQUIRE(one);
  CHECK((one->center - Eigen::Vector3d{1, 2, 3}).norm() < 1e-15);
  CHECK(one->half_extents.maxCoeff() < 1e-12);
  Eigen::Matrix3Xd segment(3, 2);
  segment << 0, 1, 0, 2, 0, 2;
  CHECK(2 * minimum_volume_box(segment)->half_extents[0] == doctest::Approx(3));
  Eigen::Matrix3Xd square(3, 4);
  square << 0, 1, -1, 0, 0, 1, 1, 2, 5, 5, 6, 6;
  const auto flat = minimum_volume_box(square);
  CHECK(flat->half_extents[2] < 1e-12);
  CHECK(4 * flat->half_extents[0] * flat->half_extents[1] ==
        doctest::Approx(convex_hull(square).measure()));
  CHECK_THROWS_AS((void)minimum_volume_box(Eigen::Matrix4Xd(4, 3)), invalid_input);
  CHECK_THROWS_AS((void)flat->contains(Eigen::Vector2d{0, 0}), invalid_input);
}
