// SPDX-License-Identifier: MIT
//
// A metric of your own: poses of a robot in the plane, metres and an angle that wraps around. A
// plain struct with `term`, `distance` and `sum` serves in a kd-tree; `term_to` is needed only for
// what wraps.
#include <algorithm>
#include <cmath>
#include <iostream>

import cilantro;
using namespace cilantro;

/// √(Δx² + Δy² + (2 m · Δθ)²): turning by a radian is as far as going two metres.
struct pose_distance {
  static constexpr int dimension = 3;

  static float term(float difference, index_t axis) {
    return axis < 2 ? difference * difference : 4 * so2::term(difference, axis);
  }
  static float term_to(float value, float low, float high, index_t axis) {
    if (axis == 2) return 4 * so2::term_to(value, low, high, axis);
    const float outside = std::max({low - value, value - high, 0.0f});
    return outside * outside;
  }
  static float distance(float sum) { return std::sqrt(sum); }
  static float sum(float distance) { return distance * distance; }
};

int main() {
  random_stream random{1};
  Eigen::Matrix3Xf poses(3, 2000);
  for (auto pose : poses.colwise())
    pose = Eigen::Vector3d{random.uniform(0, 10), random.uniform(0, 10), random.uniform(-3.1, 3.1)}
               .cast<float>();

  const kd_tree tree{poses, pose_distance{}};
  const auto violations = check_neighbor_searcher(tree, poses, {}, pose_distance{});
  for (const auto& violation : violations) std::cout << violation << '\n';

  const auto nearest = tree.nearest(Eigen::Vector3f{5, 5, 3.14f});
  std::cout << "the pose nearest to (5, 5, 3.14) is " << poses.col(nearest->index).transpose()
            << ", " << nearest->distance << " away\n";
  return violations.empty() && nearest->distance < 1 ? 0 : 1;
}
