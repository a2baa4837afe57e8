// SPDX-License-Identifier: MIT
//
// Real scans from anywhere: a room of Kinect frames, and a street of a lidar.
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

TEST_CASE("frames of a room are put in their places, and none is left out") {
  const auto folder = test::data_file("rgbd/7scenes_1000");
  SKIP_WITHOUT(folder);
  const pinhole_camera<float> camera{640, 480, 585, 585, 320, 240};
  std::vector<point_cloud<float, 3>> frames;
  std::vector<Eigen::Isometry3d> poses;
  for (int number = 0; number < 1000; number += number < 20 ? 5 : 10) {
    char name[32];
    std::snprintf(name, sizeof name, "frame-%06d", number);
    const std::string base = (*folder / name).string();
    if (!std::filesystem::exists(base + ".depth.png")) continue;
    frames.push_back(cloud_from_depth(read_depth_png(base + ".depth.png"), camera) |
                     remove_invalid() | voxel_downsample(0.05));
    std::ifstream in{base + ".pose.txt"};
    Eigen::Matrix4d matrix;
    for (int i = 0; i < 16; ++i) in >> matrix(i / 4, i % 4);
    poses.emplace_back(matrix);
  }
  REQUIRE(frames.size() > 20);
  const auto found = align_many(frames, {.voxel = 0.05, .viewpoint = coordinates{0, 0, 0}});
  CHECK(found.component_of == index_list(frames.size(), 0));
  double worst = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Eigen::Isometry3d truth = poses[0].inverse() * poses[i];
    worst = std::max(worst, (found.poses[i].translation() - truth.translation()).norm());
  }
  MESSAGE(frames.size() << " frames, farthest " << worst << " m");
  CHECK(worst < 0.25);
}

TEST_CASE("scans of a car are found from anywhere, as from where they are") {
  const auto folder = test::data_file("registration/kitti00");
  SKIP_WITHOUT(folder);
  const auto scan = [&](const char* name) {
    std::ifstream in{*folder / name, std::ios::binary};
    const std::string bytes{std::istreambuf_iterator<char>{in}, {}};
    Eigen::Matrix4Xf records(4, std::ssize(bytes) / 16);
    std::memcpy(records.data(), bytes.data(), bytes.size());
    return point_cloud<float, 3>{.points = records.topRows<3>()};
  };
  const auto target = scan("000000.bin"), source = scan("000002.bin");
  const auto near = align(source, target, {.scales = {{0.5, 3}, {0.25, 1}}, .normals = radius{1}});
  for (const double voxel : {0.5, 0.8}) {
    const auto found = align_globally(source, target,
                                      {.voxel = voxel,
                                       .source_viewpoint = coordinates{0, 0, 0},
                                       .target_viewpoint = coordinates{0, 0, 0}});
    const double apart = (found.transform.translation() - near.transform.translation()).norm();
    MESSAGE("voxel " << voxel << ": " << found << ", " << apart << " m from ICP");
    CHECK(apart < 1);
    CHECK(found.transform.linear().isApprox(near.transform.linear(), 0.02F));
  }
}
