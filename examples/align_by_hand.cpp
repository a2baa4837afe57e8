// SPDX-License-Identifier: MIT
//
// What `align` does in one call, taken apart into a searcher, an estimator and the loop: replace
// any of them by one of yours. Both ways give the same bits.
#include <iostream>

import cilantro;
import simulated_room;
using namespace cilantro;

int main() {
  const auto scan_of = [](int step) {
    const auto frame = simulate(step, {.width = 320, .height = 240, .noise = 0.001});
    auto camera = frame.camera;
    camera.to_world.setIdentity();  // Each scan in the coordinates of its camera.
    return cloud_from_depth(frame.depth, camera) | voxel_downsample(0.03);
  };
  const auto target = scan_of(0) | estimate_normals(knn{10}), source = scan_of(2);

  const auto found = align(source, target, {.max_distance = 0.1, .max_iterations = 40});

  const nearest_neighbor_searcher searcher{source, target, {.max_distance = 0.1}};
  const least_squares_estimator estimator{source, target, point_to_plane{}};
  const auto by_hand = icp(searcher, estimator, {.max_iterations = 40});

  const auto truth = simulated_camera(0, {}).to_world.inverse() * simulated_camera(2, {}).to_world;
  const double error = (found.transform.translation() - truth.translation()).norm();
  std::cout << found.status << " after " << found.iterations << " iterations, " << error * 1000
            << " mm from the truth; " << found.pairs << " pairs cover " << found.overlap
            << " of the source\n";
  const bool is_same = found.transform.matrix() == by_hand.transform.matrix();
  std::cout << "by hand: " << (is_same ? "the same bits\n" : "other bits\n");
  return found.converged() && is_same && error < 0.005 ? 0 : 1;
}
