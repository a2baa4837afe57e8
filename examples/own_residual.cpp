// SPDX-License-Identifier: MIT
//
// A metric of your own: distances to planes, measured in standard deviations of a depth camera,
// whose noise grows with the square of the distance. Far points are no longer worth as much.
#include <iostream>

import cilantro;
import simulated_room;
using namespace cilantro;

/// The residual of a pair and its derivative by the source point: all that a metric is.
struct plane_in_deviations {
  static constexpr bool needs_target_normals = true;
  double deviation;  ///< Of the noise at one metre, in metres.

  template <int D, class Emit>
  void operator()(const matched_pair<D>& pair, const Emit& emit) const {
    const double scale = 1 / (deviation * pair.target.squaredNorm());
    emit(scale * (pair.point - pair.target).dot(pair.target_normal), scale * pair.target_normal);
  }
};
static_assert(ResidualTerm<plane_in_deviations, 3>);

int main() {
  const auto violations = check_residual_term<3>(plane_in_deviations{0.001});
  for (const auto& violation : violations) std::cout << violation << '\n';

  const auto scan_of = [](int step) {
    const auto frame = simulate(step, {.width = 320, .height = 240, .noise = 0.01});
    auto camera = frame.camera;
    camera.to_world.setIdentity();
    return cloud_from_depth(frame.depth, camera) | voxel_downsample(0.03);
  };
  const auto truth = simulated_camera(0, {}).to_world.inverse() * simulated_camera(2, {}).to_world;
  const auto target = scan_of(0), source = scan_of(2);
  const auto error = [&](const auto& found) {
    return 1000 * (found.transform.translation() - truth.translation()).norm();
  };
  const double plain = error(align(source, target, {.max_distance = 0.2, .normals = knn{20}}));
  const double ours = error(align(source, target, plane_in_deviations{0.0025},
                                  {.max_distance = 0.2, .normals = knn{20}}));
  std::cout << plain << " mm off with distances, " << ours << " mm with deviations\n";
  return violations.empty() && ours < plain ? 0 : 1;
}
