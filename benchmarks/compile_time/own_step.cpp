// SPDX-License-Identifier: MIT
import cilantro;
using namespace cilantro;

index_t unit(const point_cloud<double, 3>& cloud) {
  const auto low = step{[](const auto& c) {
    return select(c, [&](index_t i) { return c.points(2, i) < c.points.row(2).mean(); });
  }};
  const kd_tree tree{cloud.points};
  const auto near = find_neighborhoods(tree, cloud.points, knn{10});
  return (cloud | low | voxel_downsample(0.1)).size() + near.total();
}
