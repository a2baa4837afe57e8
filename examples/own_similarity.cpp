// SPDX-License-Identifier: MIT
//
// A similarity of your own: two points belong together if the surface between them is smooth and
// none of them is much nearer to the camera. A lambda is all that it takes.
#include <algorithm>
#include <cmath>
#include <iostream>

import cilantro;
import simulated_room;
using namespace cilantro;

int main() {
  const auto frame = simulate(0, {.width = 320, .height = 240, .noise = 0.001});
  const Eigen::Vector3d eye = frame.camera.to_world.translation();
  const auto cloud =
      cloud_from_depth(frame.depth, frame.camera) | estimate_normals(knn{20}, {.viewpoint = eye});

  const double cos_limit = std::cos(0.2);
  const auto smooth = [&](index_t i, index_t j, double) {
    const double near = (cloud.points.col(i) - eye).norm();
    const double far = (cloud.points.col(j) - eye).norm();
    return std::abs(near - far) < 0.03 * std::min(near, far) &&
           cloud.normals.col(i).dot(cloud.normals.col(j)) > cos_limit;
  };

  const kd_tree tree{cloud.points};
  const auto violations =
      check_similarity_function(smooth, find_neighborhoods(tree, cloud.points, knn{5}));
  for (const auto& violation : violations) std::cout << violation << '\n';

  const auto parts = connected_components(tree, cloud, knn{20}, smooth, {.min_cluster_size = 100});
  std::cout << parts.size() << " smooth parts:";
  for (const index_t size : parts.sizes()) std::cout << ' ' << size;
  std::cout << "\n" << parts.unlabeled() << " points in none\n";
  return violations.empty() && parts.size() >= 4 ? 0 : 1;
}
