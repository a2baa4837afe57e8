// SPDX-License-Identifier: MIT
//
// A cloud of Open3D's, seen in place by cilantro, and both in one program.
#include <open3d/geometry/PointCloud.h>

#include <iostream>

import cilantro;

int main() {
  open3d::geometry::PointCloud scan;
  for (int i = 0; i < 100; ++i) scan.points_.emplace_back(0.1 * (i % 10), 0.1 * (i / 10), 0);
  const auto theirs = scan.VoxelDownSample(0.25);
  const auto ours = cilantro::voxel_downsample(scan.points_, 0.25);
  std::cout << "consumed: " << theirs->points_.size() << " and " << ours.cols() << '\n';
  return ours.cols() == 16 && !theirs->points_.empty() ? 0 : 1;
}
