// SPDX-License-Identifier: MIT
//
// Every step is first a plain function on points of any dimension: here a planar laser scan in
// double.
#include <cmath>
#include <iostream>
#include <numbers>
#include <vector>

import cilantro;
using namespace cilantro;

int main() {
  // A round room of radius 3 around the scanner.
  std::vector<Eigen::Vector2d> scan;
  for (int i = 0; i < 360; ++i) {
    const double angle = i * std::numbers::pi / 180;
    scan.emplace_back(3 * std::cos(angle), 3 * std::sin(angle));
  }
  const auto [normals, curvature] = estimate_normals(scan, knn{8}, {.viewpoint = {{0, 0}}});
  const auto thinned = voxel_downsample(scan, 0.5);
  const auto whole = mean_and_covariance(scan);

  double worst = 0;
  for (index_t i = 0; i < normals.cols(); ++i)
    worst = std::max(worst, std::acos(std::min(1.0, -normals.col(i).dot(scan[i].normalized()))));
  std::cout << "worst normal: " << worst << " rad off; " << thinned.cols()
            << " points remain; mean " << whole->mean.transpose() << '\n';
  return worst < 0.01 && whole->mean.norm() < 1e-9 ? 0 : 1;
}
