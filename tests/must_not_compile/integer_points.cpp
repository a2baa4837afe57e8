// SPDX-License-Identifier: MIT
// message: does not satisfy 'CoordinatesAreFloatOrDouble'
import cilantro;

int main() {
  const Eigen::Matrix3Xi points(3, 10);
  return static_cast<int>(cilantro::voxel_downsample(points, 1).cols());
}
