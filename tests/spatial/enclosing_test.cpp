// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <doctest/doctest.h>

#include "spaces.hpp"
import cilantro;
import test_support;

using namespace cilantro;

TEST_CASE_TEMPLATE("no smaller ball contains the points than that through some of them", T,
                   ALL_SPACES) {
  using S = typename T::scalar;
  auto points = test::random_points<T>(300, 5);
  points(0, 10) = test::nan<S>;
  const auto ball = minimum_enclosing_ball(points);
  REQUIRE(ball);
  for (index_t i = 0; i < points.cols(); ++i)
    if (i != 10)
      CHECK((points.col(i).template cast<double>() - ball->center).norm() <=
            ball->radius * (1 + 1e-12));
  // The centre is within the hull of the points that it touches: no step makes the ball smaller.
  REQUIRE(ball->support.size() >= 2);
  Eigen::MatrixXd touched(T::dimension, std::ssize(ball->support));
  for (index_t k = 0; k < touched.cols(); ++k) {
    touched.col(k) = points.col(ball->support[k]).template cast<double>();
    CHECK((touched.col(k) - ball->center).norm() == doctest::Approx(ball->radius).epsilon(1e-10));
  }
  const auto hull = convex_hull(touched);
  CHECK(hull.contains(ball->center, 1e-9));
}

TEST_CASE("balls about no point, one point and equal ones") {
  CHECK_FALSE(minimum_enclosing_ball(Eigen::Matrix3Xd(3, 0)));
  const auto one = minimum_enclosing_ball(Eigen::Matrix3Xd{Eigen::Vector3d{1, 2, 3}});
  CHECK(one->radius == 0);
  CHECK(one->center == Eigen::Vector3d{1, 2, 3});
  const Eigen::Matrix3Xf same = Eigen::Vector3f{5, 5, 5}.replicate(1, 100);
  CHECK(minimum_enclosing_ball(same)->radius == 0);
  Eigen::Matrix4Xd square(4, 4);
  square << 0, 1, 0, 1, 0, 0, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3;
  CHECK(minimum_enclosing_ball(square)->radius == doctest::Approx(std::sqrt(0.5)));
}

TEST_CASE("the outline of a table top, whatever the noise across it") {
  random_stream random{3};
  Eigen::Matrix3Xd points(3, 2000);
  const Eigen::Vector3d u = Eigen::Vector3d{1, 1, 0.2}.normalized();
  const Eigen::Vector3d v = u.cross(Eigen::Vector3d{0, 0, 1}).normalized();
  const Eigen::Vector3d n = u.cross(v);
  const Eigen::Vector3d middle{100, -50, 3};
  for (index_t i = 0; i < points.cols(); ++i)
    points.col(i) = middle + u * random.uniform(-1, 1) + v * random.uniform(-0.5, 0.5) +
                    n * random.uniform(-0.002, 0.002);
  for (int corner = 0; corner < 4; ++corner)
    points.col(corner) = middle + u * (corner % 2 == 0 ? -1 : 1) + v * (corner < 2 ? -0.5 : 0.5);
  const auto top = flat_convex_hull(points, {.tolerance = 0.005});
  CHECK(std::abs(top.normal.dot(n)) == doctest::Approx(1).epsilon(1e-6));
  CHECK(top.area == doctest::Approx(2).epsilon(1e-4));
  CHECK(top.thickness > 0.0035);
  CHECK(top.thickness < 0.005);
  CHECK(std::ranges::count_if(top.indices, [](auto i) { return i < 4; }) == 4);
  double turned = 0;
  for (index_t k = 0; k < top.polygon.cols(); ++k) {
    const Eigen::Vector3d a = top.polygon.col(k), b = top.polygon.col((k + 1) % top.polygon.cols());
    CHECK(std::abs(top.normal.dot(a) - top.offset) < 1e-9);
    turned += (a - middle).cross(b - middle).dot(top.normal) / 2;
  }
  CHECK(turned == doctest::Approx(top.area));
  CHECK_THROWS_WITH_AS((void)flat_convex_hull(points, {.tolerance = 0.001}),
                       doctest::Contains("more than the tolerance"), invalid_input);
  CHECK_THROWS_AS((void)flat_convex_hull(Eigen::Matrix3Xd(points.leftCols(2)), {.tolerance = 1}),
                  invalid_input);
}

TEST_CASE("crops by polytopes and regions keep what they contain, and check_region says so") {
  const auto points = test::random_points<test::f3>(5000, 2, -2, 2);
  point_cloud<float, 3> cloud{.points = points};
  cloud.points(1, 7) = test::nan<float>;
  cloud.origin = Eigen::Vector3d{1000, 0, 0};
  const convex_polytope<3> around{box{{999, -1, -1}, {1001, 1, 1}}};
  const space_region hollow =
      around - convex_polytope<3>{box{{999.5, -0.5, -0.5}, {1000.5, 0.5, 0.5}}};
  index_t inside = 0;
  for (index_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d p = cloud.points.col(i).cast<double>() + cloud.origin;
    inside += is_finite(p) && hollow.contains(p);
  }
  CHECK(crop(cloud, hollow).size() == inside);
  CHECK((cloud | crop(hollow)).size() == inside);
  CHECK((cloud | remove_inside(hollow)).size() == cloud.size() - 1 - inside);
  CHECK(crop(cloud, around).size() > inside);
  CHECK(check_region(around, cloud).empty());
  CHECK(check_region(hollow, cloud).empty());
  CHECK(check_region(ball{{1000, 0, 0}, 1}, cloud).empty());
  CHECK(check_region(cylinder{{999, 0, 0}, {1001, 0, 0}, 1}, cloud).empty());
  bool flips = false;
  const auto fickle = [&](const Eigen::Vector3d&) { return flips = !flips; };
  CHECK_FALSE(check_region(fickle, Eigen::Matrix3Xd{points.leftCols(1).cast<double>()}).empty());
  CHECK_THROWS_AS((void)crop(points, convex_polytope<>{box{{0, 0}, {1, 1}}}), invalid_input);
}
