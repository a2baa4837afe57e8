// SPDX-License-Identifier: MIT
//
// A step of your own in a pipeline: a lambda over clouds, which `step` makes compose with those of
// the library. This one shades a cloud by its height.
#include <algorithm>
#include <iostream>

import cilantro;
import simulated_room;
using namespace cilantro;

/// Colours from blue at `low` to red at `high`, in the units of the points.
auto color_by_height(double low, double high) {
  return step{[=](auto cloud) {
    cloud.colors.resize(3, cloud.size());
    for (index_t i = 0; i < cloud.size(); ++i) {
      const double share = std::clamp((double(cloud.points(2, i)) - low) / (high - low), 0.0, 1.0);
      cloud.colors.col(i) = Eigen::Vector3d{share, 0.2, 1 - share}.cast<float>();
    }
    return cloud;
  }};
}

int main() {
  const auto frame = simulate(0, {.width = 160, .height = 120});
  const auto prepare = voxel_downsample(0.05) | color_by_height(0, 2.5) |
                       remove_statistical_outliers({.neighbors = 10, .deviations = 3});
  const auto cloud = cloud_from_depth(frame.depth, frame.camera) | prepare;
  std::cout << cloud.size() << " points in colour\n";
  return cloud.has_colors() && cloud.colors.minCoeff() >= 0 && cloud.colors.maxCoeff() <= 1 ? 0 : 1;
}
