// SPDX-License-Identifier: MIT
//
// From a folder of depth images to where the camera was: odometry [FOLDER], of 16-bit PNG images in
// millimetres of a Kinect, in the order of their names. Without a folder, images are simulated.
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

import cilantro;
import simulated_room;
using namespace cilantro;

/// Six frames as files, and the poses they were taken from.
std::vector<Eigen::Isometry3d> simulate_into(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  std::vector<Eigen::Isometry3d> truth;
  for (int i = 0; i < 6; ++i) {
    const auto frame = simulate(i, {.width = 320, .height = 240, .noise = 0.001});
    write_png(frame.depth, folder / ("frame-" + std::to_string(i) + ".depth.png"));
    truth.push_back(frame.camera.to_world);
  }
  return truth;
}

int main(int argc, char** argv) {
  const std::filesystem::path folder = argc > 1 ? argv[1] : "odometry-frames";
  const auto truth = argc > 1 ? std::vector<Eigen::Isometry3d>{} : simulate_into(folder);
  auto camera = simulated_camera(0, {.width = 320, .height = 240});
  camera.to_world.setIdentity();
  if (argc > 1) camera = {640, 480, 585, 585, 320, 240};

  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator{folder})
    if (entry.path().string().ends_with(".depth.png")) files.push_back(entry.path());
  std::ranges::sort(files);

  const auto read = [&](const auto& file) {
    return cloud_from_depth(read_depth_png(file), camera);
  };
  const auto prepare = remove_invalid() | voxel_downsample(0.01);
  const auto path = files | each(read) | each(prepare, {.ahead = 2}) | odometry({.voxel = 0.02});

  double worst = 0;
  for (std::size_t i = 0; i < path.frames.size(); ++i) {
    const auto& frame = path.frames[i];
    std::cout << "frame " << i << " is " << frame.status << ", at "
              << frame.pose.translation().transpose() << '\n';
    if (!truth.empty())
      worst = std::max(worst,
                       (truth[0].inverse() * truth[i] * frame.pose.inverse()).translation().norm());
  }
  std::cout << path.map.size() << " points in the map\n";
  return worst < 0.02 && path.frames.size() > 1 && path.lost().empty() ? 0 : 1;
}
