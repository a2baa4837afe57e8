// SPDX-License-Identifier: MIT
//
// A survey by hand, in pieces that fit into memory: voxels, outliers and normals of each PLY file
// of a folder, alone, with Open3D. What lies across the borders of two files is not seen, and
// outliers are those of a file.
//
//   pieces_open3d FOLDER OUT
#include <chrono>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>

#include "open3d/geometry/PointCloud.h"
#include "open3d/io/PointCloudIO.h"

namespace {

long most_memory() {
  std::ifstream in{"/proc/self/status"};
  std::string word;
  long kilobytes = 0;
  while (in >> word)
    if (word == "VmHWM:") in >> kilobytes;
  return kilobytes / 1000;
}

int run(const std::filesystem::path& folder, const std::filesystem::path& out) {
  std::filesystem::create_directories(out);
  const auto start = std::chrono::steady_clock::now();
  std::size_t read = 0, left = 0, files = 0;
  for (const auto& file : std::filesystem::directory_iterator{folder}) {
    if (file.path().extension() != ".ply") continue;
    open3d::geometry::PointCloud cloud;
    if (!open3d::io::ReadPointCloud(file.path().string(), cloud)) return 1;
    read += cloud.points_.size();
    const auto thin = cloud.VoxelDownSample(0.4);
    const auto [kept, indices] = thin->RemoveStatisticalOutliers(10, 3);
    kept->EstimateNormals(open3d::geometry::KDTreeSearchParamKNN(10));
    if (!open3d::io::WritePointCloud((out / file.path().filename()).string(), *kept)) return 1;
    left += kept->points_.size();
    ++files;
  }
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::printf("%zu files in pieces: %.1f s, %.2f million points a second, %ld MB at most\n", files,
              seconds, double(read) / seconds / 1e6, most_memory());
  std::printf("%zu points are left\n", left);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: the head of benchmarks/peers/open3d_pieces.cpp\n";
    return 2;
  }
  try {
    return run(argv[1], argv[2]);
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
