// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <ranges>
#include <stop_token>
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
  CHECK(unproject(depth, camera, depth_scale{.units_per_metre = 500}).col(0).z() ==
        doctest::Approx(7));
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
  CHECK_THROWS_AS((void)unproject(depth, camera, depth_scale{.units_per_metre = 0}), invalid_input);
  const Eigen::Matrix3Xd points(3, 0);
  CHECK_THROWS_AS((void)project(points, camera, {.point_size = -1}), invalid_input);
  CHECK(project(points, camera).pixels() == std::vector<std::int32_t>(12, -1));
  camera.fx = 0;
  CHECK_THROWS_AS((void)unproject(depth, camera), invalid_input);
  CHECK_THROWS_AS((void)project(points, camera), invalid_input);
  camera.fx = test::nan<double>;
  CHECK_THROWS_AS((void)project(points, camera), invalid_input);
}

TEST_CASE("pictures are viewed where they lie: rows with a stride, Eigen matrices, images") {
  Eigen::Matrix<std::uint16_t, -1, -1, Eigen::RowMajor> matrix(3, 6);
  for (index_t i = 0; i < matrix.size(); ++i) matrix.data()[i] = std::uint16_t(1000 + i);
  const auto camera = small_camera();
  const auto of_block = unproject(matrix.leftCols(4), camera);
  const auto of_pointer = unproject(image_view{matrix.data(), 4, 3, 6}, camera);
  image<std::uint16_t> copy(4, 3);
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 4; ++x) copy(x, y) = matrix(y, x);
  CHECK(of_block == unproject(copy, camera));
  CHECK(of_pointer == of_block);
  CHECK_THROWS_AS((image_view{matrix.data(), 4, 3, 3}), invalid_input);
  CHECK_THROWS_AS((image_view<float>{nullptr, 4, 3}), invalid_input);
}
static_assert(!ImageSource<Eigen::MatrixXf>);  // Column-major: its rows are not adjacent.
static_assert(DepthConverter<depth_scale, std::uint16_t> && DepthConverter<disparity, float>);
static_assert(!DepthConverter<int, float>);

TEST_CASE("depth may be metres, truncated, a disparity, or whatever a function says") {
  const auto depth_of = [](const auto& stored, const auto& convert) {
    return to_depth<double>(stored, convert)(0, 0);
  };
  const image<float> metres(1, 1, 2.5f);
  const image<std::uint16_t> millimetres(1, 1, 2500);
  CHECK(depth_of(metres, depth_scale{}) == 2.5);
  CHECK(depth_of(millimetres, depth_scale{}) == doctest::Approx(2.5));
  CHECK(depth_of(millimetres, depth_scale{.units_per_metre = 5000}) == doctest::Approx(0.5));
  CHECK(depth_of(metres, truncated_depth{0.5, 2.5, depth_scale{}}) == 2.5);
  CHECK(depth_of(metres, truncated_depth{0.5, 2.4, depth_scale{}}) == 0);
  CHECK(depth_of(metres, truncated_depth{2.6, 9.0, depth_scale{}}) == 0);
  CHECK(depth_of(metres, disparity{.focal_length = 500, .baseline = 0.1}) == 20);
  CHECK(depth_of(metres, [](float v) { return -v; }) == 0);
  for (const float nothing : {0.0f, -1.0f, test::nan<float>, test::infinity<float>})
    CHECK(depth_of(image<float>(1, 1, nothing), depth_scale{}) == 0);
  CHECK(depth_of(image<std::uint16_t>(1, 1, 0), disparity{500, 0.1}) == 0);
  CHECK_THROWS_AS((void)disparity(-1, 0.1), invalid_input);
}

TEST_CASE_TEMPLATE("normals of a depth image are those of its planes, and holes are counted", S,
                   float, double) {
  const auto frame = simulate(3, {.width = 160, .height = 120});
  const auto& c = frame.camera;
  const pinhole_camera<S> camera{
      c.width, c.height, S(c.fx), S(c.fy), S(c.cx), S(c.cy), c.to_world.cast<S>()};
  image<float> depth(160, 120);
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x)
      depth(x, y) = float((c.to_world.inverse() * frame.points.col(y * 160 + x)).z());
  depth(50, 50) = 0;
  const auto cloud = cloud_from_depth(depth, camera, {.normals = true, .organized = true});
  CHECK((cloud.width == 160 && cloud.height == 120));
  const auto unknown = [&](int x, int y) { return cloud.normals.col(y * 160 + x).isZero(0); };
  for (int x = 0; x < 160; ++x) CHECK((unknown(x, 0) && unknown(x, 119)));
  for (int y = 0; y < 120; ++y) CHECK((unknown(0, y) && unknown(159, y)));
  CHECK((unknown(50, 50) && unknown(49, 50) && unknown(51, 50) && unknown(50, 49) &&
         unknown(50, 51)));
  CHECK_FALSE(unknown(49, 49));
  // The room is made of planes along the axes and of curved things.
  index_t known = 0, flat = 0;
  for (index_t i = 0; i < cloud.size(); ++i) {
    const auto n = cloud.normals.col(i);
    if (n.isZero(0)) continue;
    ++known;
    flat += n.cwiseAbs().maxCoeff() > S(0.999);
    CHECK(n.dot(camera.to_world.translation() - cloud.points.col(i)) >= 0);
  }
  CHECK(double(flat) > 0.6 * double(known));
  for (const int threads : {1, 2, 5})
    CHECK(organized_normals(cloud.points, camera, {.threads = threads}) == cloud.normals);
  const auto compact = cloud_from_depth(depth, camera, {.normals = true});
  CHECK(compact.size() == 160 * 120 - 1);
  CHECK_FALSE(compact.is_organized());
  CHECK(compact == remove_invalid(cloud));
}

TEST_CASE("points become a depth image and a picture again, for any number of threads") {
  const auto frame = simulate(11, {.width = 160, .height = 120});
  image<rgb> colors(160, 120);
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x) colors(x, y) = {std::uint8_t(x), std::uint8_t(y), 7};
  const auto cloud = cloud_from_rgbd(frame.depth, colors, frame.camera);
  CHECK(cloud.has_colors());
  const auto back = project_depth(cloud.points, frame.camera);
  CHECK(quantize_depth(back) == frame.depth);
  const auto seen = project(cloud.points, frame.camera, {.threads = 1});
  const auto painted = project_colors(cloud, seen);
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x)
      if (seen(x, y) >= 0) CHECK(painted(x, y) == colors(x, y));
  for (const int threads : {2, 5})
    CHECK(project(cloud.points, frame.camera, {.point_size = 0.1, .threads = threads}) ==
          project(cloud.points, frame.camera, {.point_size = 0.1, .threads = 1}));
  CHECK_THROWS_AS((void)cloud_from_rgbd(frame.depth, image<rgb>(3, 3), frame.camera),
                  invalid_input);
  CHECK_THROWS_AS((void)project_colors(point_cloud<double, 3>{}, seen), invalid_input);
}

TEST_CASE("depth that does not fit 16 bits is unknown") {
  image<float> depth(5, 1);
  depth(0, 0) = 65.5344f;
  depth(1, 0) = 65.5346f;
  depth(2, 0) = test::nan<float>;
  depth(3, 0) = -1;
  depth(4, 0) = 0.0005001f;
  CHECK(quantize_depth(depth).pixels() == std::vector<std::uint16_t>{65534, 0, 0, 0, 1});
}

TEST_CASE("a depth that is infinite or no number is none") {
  image<float> depth{4, 3, 1.0f};
  depth(1, 0) = test::infinity<float>;
  depth(2, 0) = test::nan<float>;
  depth(3, 0) = -1;
  const pinhole_camera<float> camera{.width = 4, .height = 3, .fx = 2, .fy = 2, .cx = 1, .cy = 1};
  CHECK(unproject_known(depth, camera).cols() == 9);
  CHECK(cloud_from_depth(depth, camera).size() == 9);
}

TEST_CASE("making a cloud of a depth image can be watched and stopped") {
  const auto frame = simulate(0, {.width = 64, .height = 48});
  const image<rgb> colors{64, 48};
  for (const bool normals : {false, true})
    for (const bool organized : {false, true}) {
      std::vector<double> shares;
      const auto watch = [&](double share) { shares.push_back(share); };
      const depth_cloud_options options{
          .normals = normals, .organized = organized, .threads = 1, .monitor = {watch, {}}};
      (void)cloud_from_depth(frame.depth, frame.camera, options);
      CHECK((std::ranges::is_sorted(shares) && shares.back() == 1));
      shares.clear();
      (void)cloud_from_rgbd(frame.depth, colors, frame.camera, options);
      CHECK((std::ranges::is_sorted(shares) && shares.back() == 1));
      std::stop_source stop;
      stop.request_stop();
      CHECK_THROWS_AS(
          (void)cloud_from_depth(
              frame.depth, frame.camera,
              {.normals = normals, .organized = organized, .monitor = {.stop = stop.get_token()}}),
          cancelled);
    }
}

TEST_CASE("frames go through the standard views") {
  const auto camera = small_camera();
  const std::vector<image<std::uint16_t>> frames(3, image<std::uint16_t>(4, 3, 1000));
  index_t points = 0;
  for (const auto& cloud : frames | std::views::transform(to_cloud(camera))) points += cloud.size();
  CHECK(points == 36);
}

TEST_CASE(
    "depth is in millimetres if it is whole, in metres if not, and in units of a metre if said") {
  const pinhole_camera<double> camera{4, 3, 100, 100, 2, 1.5};
  CHECK(unproject(image<std::uint16_t>(4, 3, 1500), camera)(2, 0) == 1.5);
  CHECK(unproject(image<float>(4, 3, 1.5f), camera)(2, 0) == 1.5);
  CHECK(unproject(image<std::uint16_t>(4, 3, 5000), camera, depth_scale{5000})(2, 0) == 1);
  CHECK(unproject(image<float>(4, 3, 1500), camera, depth_scale{1000})(2, 0) == 1.5);
}
