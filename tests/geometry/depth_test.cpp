// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "spaces.hpp"

import cilantro;
import simulated_room;
import test_support;

using namespace cilantro;

namespace {

pinhole_camera<double> small_camera() {
  return {.width = 4, .height = 3, .fx = 2, .fy = 2, .cx = 1.5, .cy = 1};
}

}  // namespace

TEST_CASE("a pixel is unprojected to where its ray has that depth") {
  auto camera = small_camera();
  image<std::uint16_t> depth(4, 3, 1000);
  depth(3, 2) = 2000;
  const auto points = unproject(depth, camera);
  CHECK(points.cols() == 12);
  CHECK(points.col(0).isApprox(Eigen::Vector3d{-0.75, -0.5, 1}));
  CHECK(points.col(11).isApprox(Eigen::Vector3d{1.5, 1, 2}));
  camera.to_world.translation() = Eigen::Vector3d{0, 0, 5};
  CHECK(unproject(depth, camera).col(0).isApprox(Eigen::Vector3d{-0.75, -0.5, 6}));
  CHECK(unproject(depth, camera, {.metres_per_unit = 0.002}).col(0).z() == doctest::Approx(7));
}

TEST_CASE("a depth of 0 or 65535 is no point, and stays in its place") {
  image<std::uint16_t> depth(4, 3, 1000);
  depth(1, 0) = 0;
  depth(2, 2) = 65535;
  const auto points = unproject(depth, small_camera());
  CHECK(count_non_finite(points) == 2);
  CHECK(std::isnan(points(0, 1)));
  CHECK(std::isnan(points(2, 10)));
}

TEST_CASE("the unprojected depth of a simulated room is the room, to half a millimetre of depth") {
  for (const int step : {0, 40, 130}) {
    const auto frame = simulate(step, {.width = 160, .height = 120});
    const auto points = unproject(frame.depth, frame.camera);
    for (index_t i = 0; i < points.cols(); ++i) {
      const double z = (frame.camera.to_world.inverse() * frame.points.col(i)).z();
      CHECK((points.col(i) - frame.points.col(i)).norm() <= 0.00051 * (1 + z));
    }
  }
}

TEST_CASE_TEMPLATE("a pixel sees the point that it was unprojected to", S, float, double) {
  const auto frame = simulate(7, {.width = 160, .height = 120});
  const auto& c = frame.camera;
  const pinhole_camera<S> camera{
      c.width, c.height, S(c.fx), S(c.fy), S(c.cx), S(c.cy), c.to_world.cast<S>()};
  const auto seen = project(unproject(frame.depth, camera), camera);
  for (std::size_t i = 0; i < seen.pixels().size(); ++i) CHECK(seen.pixels()[i] == std::int32_t(i));
}

TEST_CASE("of several points in a pixel the nearest is seen, and of equal ones the first") {
  const Eigen::Matrix3Xd points{{0, 0, 0, 0, 9}, {0, 0, 0, 0, 0}, {3, 1, 1, -1, 1}};
  const auto seen = project(points, small_camera());
  CHECK(seen(2, 1) == 1);
  for (int x = 0; x < 4; ++x)
    for (int y = 0; y < 3; ++y)
      if (x != 2 || y != 1) CHECK(seen(x, y) == -1);
}

TEST_CASE("a point with a size covers the pixels that its square covers") {
  const auto camera = small_camera();
  Eigen::Matrix3Xd point = Eigen::Vector3d{0.25, 0, 1};
  const auto count = [&](double size) {
    const auto seen = project(point, camera, {.point_size = size});
    return std::ranges::count(seen.pixels(), 0);
  };
  CHECK(count(0) == 1);
  CHECK(count(0.1) == 1);
  CHECK(count(1) == 9);
  CHECK(count(1e30) == 12);
}

TEST_CASE("points that are not finite are not seen, however large they are drawn") {
  const double nan = test::nan<double>, inf = test::infinity<double>;
  const Eigen::Matrix3Xd points{{nan, 0, inf, 0, -inf}, {0, nan, 0, 0, 0}, {1, 1, 1, inf, 1}};
  const auto seen = project(points.leftCols(3), small_camera(), {.point_size = 100});
  CHECK(std::ranges::count(seen.pixels(), -1) == 12);
  CHECK_NOTHROW((void)project(points, small_camera(), {.point_size = 100}));
}

TEST_CASE("cameras and images that cannot be are refused") {
  const image<std::uint16_t> depth(4, 3, 1000);
  auto camera = small_camera();
  CHECK_THROWS_AS((void)unproject(image<std::uint16_t>(3, 3), camera), invalid_input);
  CHECK_THROWS_AS((void)unproject(depth, camera, {.metres_per_unit = 0}), invalid_input);
  const Eigen::Matrix3Xd points(3, 0);
  CHECK_THROWS_AS((void)project(points, camera, {.point_size = -1}), invalid_input);
  CHECK(project(points, camera).pixels() == std::vector<std::int32_t>(12, -1));
  camera.fx = 0;
  CHECK_THROWS_AS((void)unproject(depth, camera), invalid_input);
  CHECK_THROWS_AS((void)project(points, camera), invalid_input);
  camera.fx = test::nan<double>;
  CHECK_THROWS_AS((void)project(points, camera), invalid_input);
}
