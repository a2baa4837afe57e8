// SPDX-License-Identifier: MIT
//
// From a scan to a processed cloud: quickstart [scan.ply | depth.png]
#include <exception>
#include <filesystem>
#include <iostream>

import cilantro;
import scan_io;
using namespace cilantro;

int main(int argc, char** argv) try {
  pipeline_report report;
  scan input = argc > 1 ? open_scan(argv[1]) : simulated_scan();
  const double voxel = diagonal(input.cloud) / 300;
  const Eigen::Vector3f eye = input.camera.to_world.translation();

  std::filesystem::create_directory("out");
  // clang-format off
  const auto result = std::move(input.cloud)
      | report_to(report, "read")
      | remove_invalid()
      | report_to(report, "remove invalid")
      | voxel_downsample(voxel)
      | report_to(report, "voxel downsample")
      | estimate_normals(knn{10}, {.viewpoint = eye})
      | report_to(report, "normals and curvature")
      | write_ply("out/cloud.ply")
      | report_to(report, "write out/cloud.ply");
  // clang-format on

  write_png(shaded(result, input.camera, voxel), "out/cloud.png");
  std::cout << report << "voxels of " << voxel << "; the picture is out/cloud.png\n";
} catch (const std::exception& error) {
  std::cerr << "quickstart: " << error.what() << '\n';
  return 1;
}
