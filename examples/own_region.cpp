// SPDX-License-Identifier: MIT
//
// A region of your own: the space that a round robot sweeps on its way, a plain struct with
// `contains`. It crops clouds beside the regions of the library.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <vector>

import cilantro;
import simulated_room;
using namespace cilantro;

struct swept_path {
  std::vector<Eigen::Vector2d> corners;  ///< Of the way on the floor, in metres.
  double radius, height;

  /// Refuses points of another dimension, once and before any is asked for.
  void check(index_t dimension) const {
    if (dimension != 3) throw invalid_input{"swept_path: points must have three coordinates"};
  }
  bool contains(const Eigen::Vector3d& p) const {
    if (p.z() < 0 || p.z() > height) return false;
    for (std::size_t i = 1; i < corners.size(); ++i) {
      const Eigen::Vector2d way = corners[i] - corners[i - 1], to = p.head<2>() - corners[i - 1];
      const double along = std::clamp(to.dot(way) / way.squaredNorm(), 0.0, 1.0);
      if ((to - along * way).norm() <= radius) return true;
    }
    return false;
  }
};

int main() {
  const auto frame = simulate(0, {.width = 320, .height = 240});
  const auto cloud = cloud_from_depth(frame.depth, frame.camera) | remove_invalid();
  const swept_path path{{{-1, -1}, {1, -0.5}, {1.5, 1}}, 0.35, 1.2};
  const auto broken = check_region(path, cloud);
  for (const auto& rule : broken) std::cout << rule << '\n';

  // What stands above the floor in the way.
  const space_region floor{box{{-10, -10, -0.1}, {10, 10, 0.02}}};
  const auto in_the_way = cloud | crop(path) | remove_inside(floor);
  std::cout << in_the_way.size() << " of " << cloud.size() << " points are in the way\n";
  return broken.empty() && in_the_way.size() > 0 && in_the_way.size() < cloud.size() / 2 ? 0 : 1;
}
