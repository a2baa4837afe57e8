// SPDX-License-Identifier: MIT
//
// Steps of your own in a pipeline: a lambda over clouds, which `step` makes compose with those of
// the library, and a struct that only chooses points, which is done in one pass with others.
#include <algorithm>
#include <cmath>
#include <cstdint>
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

/// Leaves points that lie in a checkerboard of columns.
struct checkerboard {
  double edge;

  static constexpr const char* name = "checkerboard";
  static step_reach reach() { return {}; }
  template <Scalar S>
  void choose(const point_cloud<S, 3>& cloud, chosen_points& kept) const {
    kept.keep_if([&](index_t, std::int32_t i) {
      const auto field = [&](int axis) { return std::floor(double(cloud.points(axis, i)) / edge); };
      return std::fmod(field(0) + field(1), 2) == 0;
    });
  }
};

int main() {
  const auto frame = simulate(0, {.width = 160, .height = 120});
  const auto some = remove_invalid() | choosing_step{checkerboard{0.3}} | take(2000);
  const auto prepare = voxel_downsample(0.05) | color_by_height(0, 2.5) | some;
  const auto cloud = cloud_from_depth(frame.depth, frame.camera) | prepare;
  std::cout << name_of(prepare) << ": " << cloud.size() << " points in colour\n";
  return cloud.size() > 1000 && cloud.has_colors() && cloud.colors.minCoeff() >= 0 &&
                 cloud.colors.maxCoeff() <= 1
             ? 0
             : 1;
}
