// SPDX-License-Identifier: MIT
//
// A metric of your own: the distance to the plane of the source point, for a map that has no
// normals and is too large to get some. Five lines are all that a metric is.
#include <iostream>

import cilantro;
import simulated_room;
using namespace cilantro;

/// The residual of a pair, and its derivative by the source point.
struct plane_to_point {
  static constexpr bool needs_source_normals = true;

  template <int D, class Emit>
  void operator()(const matched_pair<D>& pair, const Emit& emit) const {
    emit((pair.point - pair.target).dot(pair.normal), pair.normal);
  }
};
static_assert(ResidualTerm<plane_to_point, 3>);

int main() {
  const auto violations = check_residual_term<3>(plane_to_point{});
  for (const auto& violation : violations) std::cout << violation << '\n';

  const auto scan_of = [](int step) {
    const auto frame = simulate(step, {.width = 320, .height = 240, .noise = 0.001});
    auto camera = frame.camera;
    camera.to_world.setIdentity();
    return cloud_from_depth(frame.depth, camera);
  };
  const auto map = scan_of(0);
  const auto scan = scan_of(2) | voxel_downsample(0.03) | estimate_normals(knn{10});

  const auto found = align(scan, map, plane_to_point{}, {.max_distance = 0.1});
  const auto truth = simulated_camera(0, {}).to_world.inverse() * simulated_camera(2, {}).to_world;
  const double error = (found.transform.translation() - truth.translation()).norm();
  std::cout << found.status << " after " << found.iterations << " iterations, " << 1000 * error
            << " mm from the truth\n";
  return violations.empty() && found.converged() && error < 0.005 ? 0 : 1;
}
