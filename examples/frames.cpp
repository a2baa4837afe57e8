// SPDX-License-Identifier: MIT
//
// A sequence of frames of a depth camera, each prepared by the same stored pipeline, as a standard
// view.
#include <iostream>
#include <ranges>
#include <utility>

import cilantro;
import simulated_room;
using namespace cilantro;

int main() {
  const auto to_cloud = [](int number) {
    const auto frame = simulate(number, {.width = 160, .height = 120, .noise = 0.001});
    return cloud_from_depth(frame.depth, frame.camera);
  };
  // A step of your own is a lambda, wrapped where a line begins with it.
  const auto without_ceiling = step{[](auto cloud) {
    return select(cloud, [&](index_t i) { return cloud.points(2, i) < 2.5; });
  }};
  const auto prepare = without_ceiling | voxel_downsample(0.05) | estimate_normals(radius{0.15});

  point_cloud<double, 3> map;
  for (auto cloud :
       std::views::iota(0, 5) | std::views::transform(to_cloud) | std::views::transform(prepare)) {
    std::cout << "a frame of " << cloud.size() << " points\n";
    map = append(std::move(map), cloud);
  }
  map = std::move(map) | voxel_downsample(0.05);
  std::cout << "together " << map.size() << " points\n";
  return map.size() > 1000 && map.has_normals() ? 0 : 1;
}
