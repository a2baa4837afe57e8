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

using cloud_type = point_cloud<float, 3>;

/// Writes pairs of scans, and the list of them.
class pair_writer {
 public:
  explicit pair_writer(const std::filesystem::path& folder)
      : folder_{folder}, list_{folder / "pairs.txt"} {
    list_.precision(17);
  }

  void write(const std::string& name, const cloud_type& source, const cloud_type& target,
             double max_distance, int iterations, const Eigen::Isometry3d& truth) {
    const auto with_normals = target | estimate_normals(knn{10});
    write_floats(folder_ / (name + "_source.f32"), source.points);
    write_floats(folder_ / (name + "_target.f32"), with_normals.points);
    write_floats(folder_ / (name + "_normals.f32"), with_normals.normals);
    list_ << name << ' ' << max_distance << ' ' << iterations;
    for (int i = 0; i < 16; ++i) list_ << ' ' << truth.matrix()(i / 4, i % 4);
    list_ << '\n';
  }

 private:
  std::filesystem::path folder_;
  std::ofstream list_;
};

Eigen::Isometry3d matrix_in(const std::filesystem::path& path) {
  std::ifstream in{path};
  Eigen::Isometry3d matrix;
  for (int i = 0; i < 16; ++i) in >> matrix.matrix()(i / 4, i % 4);
  return matrix;
}

void write_kinect_pairs(const std::filesystem::path& frames, pair_writer& out) {
  const auto name = [&](const char* number, const char* what) {
    return frames / (std::string{"frame-0000"} + number + what);
  };
  const auto frame = [&](const char* number) {
    return cloud_from_depth(read_depth_png(name(number, ".depth.png")), kinect) |
           voxel_downsample(0.01);
  };
  const auto target = frame("00");
  for (const char* number : {"01", "10", "20"})
    out.write(std::string{"kinect_"} + number, frame(number), target, 0.05, 15,
              matrix_in(name("00", ".pose.txt")).inverse() * matrix_in(name(number, ".pose.txt")));
}

/// Scans of the bunny where they belong (bun.conf: p_world = R(q)ᵀ p + t), the second pushed away.
void write_bunny_pair(const std::filesystem::path& scans, pair_writer& out) {
  Eigen::Isometry3f pose = Eigen::Isometry3f::Identity();
  pose.linear() = Eigen::Quaternionf{0.955586f, 0.00548449f, -0.294635f, -0.0038555f}
                      .normalized()
                      .toRotationMatrix()
                      .transpose();
  pose.translation() << -0.0520211f, -0.000383981f, -0.0109223f;
  Eigen::Isometry3f push = Eigen::Isometry3f::Identity();
  push.linear() =
      Eigen::AngleAxisf{0.05f, Eigen::Vector3f{1, 2, 3}.normalized()}.toRotationMatrix();
  push.translation() << 0.002f, -0.002f, 0.001f;
  out.write(
      "bunny",
      read_ply<float>(scans / "bun045.ply") | transform(push * pose) | voxel_downsample(0.001),
      read_ply<float>(scans / "bun000.ply") | voxel_downsample(0.001), 0.01, 30,
      Eigen::Isometry3d{push.inverse().matrix().cast<double>()});
}

void write_lidar_pair(const std::filesystem::path& scans, pair_writer& out) {
  out.write("lidar", read_ply<float>(scans / "source.ply") | voxel_downsample(0.25),
            read_ply<float>(scans / "target.ply") | voxel_downsample(0.25), 1, 30,
            matrix_in(scans / "T_target_source.txt"));
}

/// For who has none of these.
void write_simulated_pair(pair_writer& out) {
  const auto scan = [](int step) {
    const auto frame = simulate(step, {.noise = 0.001});
    auto camera = frame.camera;
    camera.to_world.setIdentity();
    return cast<float>(cloud_from_depth(frame.depth, camera)) | voxel_downsample(0.01);
  };
  out.write("simulated", scan(2), scan(0), 0.05, 15,
            simulated_camera(0, {}).to_world.inverse() * simulated_camera(2, {}).to_world);
}

}  // namespace

int main(int, char** argv) {
  const std::filesystem::path folder = argv[1], real = CILANTRO_TEST_DATA;

  pair_writer pairs{folder};
  write_simulated_pair(pairs);
  if (const auto frames = real / "rgbd/7scenes_1000"; std::filesystem::exists(frames))
    write_kinect_pairs(frames, pairs);
  if (const auto scans = real / "registration"; std::filesystem::exists(scans)) {
    write_bunny_pair(scans / "stanford_bunny_scans", pairs);
    write_lidar_pair(scans / "small_gicp", pairs);
  }

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
  write_floats(folder / "large.f32", large.points);
  write_floats(folder / "large_normals.f32", estimate_normals(large.points, knn{30}).normals);
  write_text(point_cloud<float, 3>{.points = large.points}, folder / "large.xyz", {.names = false});
  std::cout << "large.ply and its like: " << large.size() << " points\n";
}
