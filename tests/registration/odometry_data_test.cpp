// SPDX-License-Identifier: MIT
//
// The odometry of a real depth camera, beside recorded poses.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

std::string name_of_frame(int number) {
  const std::string digits = std::to_string(number);
  return "frame-" + std::string(6 - digits.size(), '0') + digits;
}

Eigen::Isometry3d recorded_pose(const std::filesystem::path& folder, int number) {
  std::ifstream in{folder / (name_of_frame(number) + ".pose.txt")};
  Eigen::Isometry3d pose;
  for (int i = 0; i < 16; ++i) in >> pose.matrix()(i / 4, i % 4);
  REQUIRE(in);
  return pose;
}

}  // namespace

TEST_CASE_TEMPLATE("a Kinect that is followed ends where its recorded poses end", S, float,
                   double) {
  const auto folder = test::data_file("rgbd/7scenes_1000");
  SKIP_WITHOUT(folder);
  std::vector<int> numbers;
  for (int i = 0; i < 30; ++i) numbers.push_back(i);
  // Half a metre and 13 degrees away, where nothing was before: it must not say that it is tracked.
  numbers.push_back(50);
  numbers.push_back(100);
  const auto read = [&](int number) {
    return cloud_from_depth(read_depth_png(*folder / (name_of_frame(number) + ".depth.png")),
                            pinhole_camera<S>{640, 480, 585, 585, 320, 240});
  };
  const auto path = numbers | each(read) | each(voxel_downsample(0.01)) | odometry({.voxel = 0.02});
  REQUIRE(path.frames.size() == numbers.size());
  double farthest = 0, most = 0;
  for (std::size_t i = 0; i + 1 < numbers.size(); ++i) {
    if (i > 0) CHECK(path.frames[i].status == odometry_status::tracked);
    const Eigen::Isometry3d truth =
        recorded_pose(*folder, 0).inverse() * recorded_pose(*folder, numbers[i]);
    const Eigen::Isometry3d error = truth.inverse() * path.frames[i].pose;
    farthest = std::max(farthest, error.translation().norm());
    most = std::max(most, std::abs(Eigen::AngleAxisd{error.linear()}.angle()));
  }
  MESSAGE("at most " << 1000 * farthest << " mm and " << most * 180 / std::numbers::pi
                     << " degrees from the recorded poses");
  CHECK(farthest < 0.012);
  CHECK(most < 0.4 * std::numbers::pi / 180);
  CHECK(path.frames.back().status == odometry_status::lost);
}
