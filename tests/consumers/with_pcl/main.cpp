// SPDX-License-Identifier: MIT
//
// A cloud of PCL's, seen in place by cilantro, and both in one program.
#include <pcl/filters/voxel_grid.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <iostream>

import cilantro;

int main() {
  pcl::PointCloud<pcl::PointXYZ>::Ptr scan{new pcl::PointCloud<pcl::PointXYZ>};
  for (int i = 0; i < 100; ++i) scan->push_back({0.1f * float(i % 10), 0.1f * float(i / 10), 0});
  pcl::VoxelGrid<pcl::PointXYZ> grid;
  grid.setInputCloud(scan);
  grid.setLeafSize(0.25f, 0.25f, 0.25f);
  pcl::PointCloud<pcl::PointXYZ> theirs;
  grid.filter(theirs);

  const cilantro::points_view<float, 3> points{scan->getMatrixXfMap().data(), 100, 4};
  const auto ours = cilantro::voxel_downsample(points, 0.25);
  std::cout << "consumed: " << theirs.size() << " and " << ours.cols() << '\n';
  return ours.cols() == 16 && theirs.size() == 16 ? 0 : 1;
}
