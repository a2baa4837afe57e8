// SPDX-License-Identifier: MIT
//
// Colour frames of depth cameras with recorded poses: by planes and by colours.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <numbers>
#include <sstream>
#include <string>
#include <utility>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

using cloud_type = point_cloud<float, 3>;

std::string padded(int number, int digits) {
  std::ostringstream text;
  text << std::setw(digits) << std::setfill('0') << number;
  return text.str();
}

Eigen::Isometry3d pose_in(std::istream& in) {
  Eigen::Isometry3d pose;
  for (int i = 0; i < 16; ++i) in >> pose.matrix()(i / 4, i % 4);
  REQUIRE(in);
  return pose;
}

struct frame {
  cloud_type cloud;
  Eigen::Isometry3d pose;
};

frame kinect_frame(const std::filesystem::path& folder, int number) {
  const auto file = [&](const char* what) {
    return folder / ("frame-" + padded(number, 6) + what);
  };
  std::ifstream in{file(".pose.txt")};
  return {cloud_from_rgbd(read_depth_png(file(".depth.png")), read_color_image(file(".color.jpg")),
                          pinhole_camera<float>{640, 480, 585, 585, 320, 240}) |
              voxel_downsample(0.01),
          pose_in(in)};
}

frame redwood_frame(const std::filesystem::path& folder, int number) {
  std::ifstream in{folder / "trajectory.log"};
  Eigen::Isometry3d pose;
  for (int k = 0; k <= number; ++k) {
    int ignored;
    in >> ignored >> ignored >> ignored;
    pose = pose_in(in);
  }
  return {cloud_from_rgbd(read_depth_png(folder / "depth" / (padded(number, 5) + ".png")),
                          read_color_image(folder / "color" / (padded(number, 5) + ".jpg")),
                          pinhole_camera<float>{640, 480, 525, 525, 319.5f, 239.5f}) |
              voxel_downsample(0.01),
          pose};
}

/// How far the source's origin is from where the recorded poses have it, and how far it is turned.
struct pose_error {
  double millimetres, degrees;
};
pose_error error_of(const align_options& options, const frame& source, const frame& target,
                    const std::string& name) {
  const auto found = align(source.cloud, target.cloud, options);
  const Eigen::Isometry3d off = (target.pose.inverse() * source.pose).inverse() *
                                Eigen::Isometry3d{found.transform.matrix().cast<double>()};
  const pose_error error{
      1000 * off.translation().norm(),
      std::abs(Eigen::AngleAxisd{off.linear()}.angle()) * 180 / std::numbers::pi};
  MESSAGE(name << ": " << error.millimetres << " mm, " << error.degrees << " deg; " << found);
  CHECK(found.converged());
  CHECK(found.overlap > 0.9);
  return error;
}

void check_colors_help(const frame& source, const frame& target, double most) {
  align_options options{.max_distance = 0.05, .max_iterations = 50, .tolerance = 1e-4};
  const auto by_plane = error_of(options, source, target, "planes");
  options.metric = colored{};
  const auto by_color = error_of(options, source, target, "colours");
  CHECK(by_color.millimetres <= by_plane.millimetres + 0.05);
  CHECK(by_color.degrees <= by_plane.degrees);
  CHECK(by_color.millimetres < most);
  options.metric = colored{0.03};
  const auto by_few = error_of(options, source, target, "few colours");
  CHECK(by_few.millimetres <= by_plane.millimetres + 0.05);
  CHECK(by_few.degrees <= by_plane.degrees);
}

}  // namespace

TEST_CASE("colours bring Kinect frames closer to their recorded poses than planes do") {
  const auto folder = test::data_file("rgbd/7scenes_1000");
  SKIP_WITHOUT(folder);
  const auto target = kinect_frame(*folder, 0);
  check_colors_help(kinect_frame(*folder, 5), target, 4);
  check_colors_help(kinect_frame(*folder, 10), target, 4);
  check_colors_help(kinect_frame(*folder, 20), target, 4.5);
}

TEST_CASE("colours bring frames of a flat with few corners closer than planes do") {
  const auto folder = test::data_file("rgbd/open3d_redwood5");
  SKIP_WITHOUT(folder);
  const auto target = redwood_frame(*folder, 0);
  check_colors_help(redwood_frame(*folder, 1), target, 4);
  check_colors_help(redwood_frame(*folder, 2), target, 1);
  check_colors_help(redwood_frame(*folder, 4), target, 5);
}
