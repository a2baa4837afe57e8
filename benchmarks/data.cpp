// SPDX-License-Identifier: MIT
//
// Writes the data that all benchmark programs read: benchmark_data FOLDER
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>

import cilantro;
import simulated_room;
using namespace cilantro;

namespace {

const pinhole_camera<float> kinect{640, 480, 585, 585, 320, 240};

void write_floats(const std::filesystem::path& path, const Eigen::Matrix3Xf& values) {
  std::ofstream{path, std::ios::binary}.write(reinterpret_cast<const char*>(values.data()),
                                              values.size() * std::streamsize(sizeof(float)));
}

/// Ten frames apart, in the coordinates of the camera, in voxels of a centimetre.
point_cloud<float, 3> frame_to_align(const std::filesystem::path& real, bool is_source) {
  const auto file = real / (std::string{"rgbd/7scenes_1000/frame-0000"} +
                            (is_source ? "10" : "00") + ".depth.png");
  const auto depth = std::filesystem::exists(file)
                         ? read_depth_png(file)
                         : simulate(is_source ? 2 : 0, {.noise = 0.001}).depth;
  return cloud_from_depth(depth, kinect) | voxel_downsample(0.01);
}

}  // namespace

int main(int, char** argv) {
  const std::filesystem::path folder = argv[1], real = CILANTRO_TEST_DATA;

  const auto target = frame_to_align(real, false) | estimate_normals(knn{10});
  write_floats(folder / "target.f32", target.points);
  write_floats(folder / "target_normals.f32", target.normals);
  write_floats(folder / "source.f32", frame_to_align(real, true).points);

  const auto depth_file = real / "rgbd/7scenes_1000/frame-000000.depth.png";
  const bool is_real = std::filesystem::exists(depth_file);
  const auto frame = [&]() -> point_cloud<float, 3> {
    if (is_real) return {.points = unproject(read_depth_png(depth_file), kinect)};
    const auto simulated = simulate(0, {.noise = 0.001});
    return cast<float>(
        point_cloud<double, 3>{.points = unproject(simulated.depth, simulated.camera)});
  }() | remove_invalid();
  write_floats(folder / "frame.f32", frame.points);
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
