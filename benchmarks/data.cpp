// SPDX-License-Identifier: MIT
//
// Writes the data that all benchmark programs read: benchmark_data FOLDER
#include <filesystem>
#include <fstream>
#include <iostream>

import cilantro;
import simulated_room;
using namespace cilantro;

int main(int, char** argv) {
  const std::filesystem::path folder = argv[1], real = CILANTRO_TEST_DATA;

  const auto depth_file = real / "rgbd/7scenes_1000/frame-000000.depth.png";
  const bool is_real = std::filesystem::exists(depth_file);
  const auto frame = [&]() -> point_cloud<float, 3> {
    if (is_real)
      return {.points = unproject(read_depth_png(depth_file),
                                  pinhole_camera<float>{640, 480, 585, 585, 320, 240})};
    const auto simulated = simulate(0, {.noise = 0.001});
    return cast<float>(
        point_cloud<double, 3>{.points = unproject(simulated.depth, simulated.camera)});
  }() | remove_invalid();
  std::ofstream{folder / "frame.f32", std::ios::binary}.write(
      reinterpret_cast<const char*>(frame.points.data()),
      frame.points.size() * std::streamsize(sizeof(float)));
  std::cout << "frame: " << frame.size() << " points, " << (is_real ? "Kinect" : "simulated")
            << '\n';

  const auto depth = is_real ? read_depth_png(depth_file) : simulate(0, {.noise = 0.001}).depth;
  std::ofstream{folder / "depth.u16", std::ios::binary}.write(
      reinterpret_cast<const char*>(depth.pixels().data()),
      std::streamsize(depth.pixels().size() * 2));

  const auto large_file = real / "large/derived/7scenes_1cm_firstpoint.ply";
  if (std::filesystem::exists(large_file)) {
    std::filesystem::copy_file(large_file, folder / "large.ply",
                               std::filesystem::copy_options::overwrite_existing);
  } else {
    point_cloud<float, 3> large;
    for (int i = 0; i < 3; ++i)
      large = append(std::move(large), {.points = (frame.points.array() + float(i)).matrix()});
    large.colors = large.points.array() - large.points.array().floor();
    write_ply(large, folder / "large.ply");
  }
  const auto large = read_ply<float>(folder / "large.ply");
  write_pcd(large, folder / "large.pcd");
  write_pcd(large, folder / "large_compressed.pcd", {.format = pcd_format::binary_compressed});
  write_text(point_cloud<float, 3>{.points = large.points}, folder / "large.xyz", {.names = false});
  std::cout << "large.ply and its like: " << large.size() << " points\n";
}
