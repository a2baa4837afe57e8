// SPDX-License-Identifier: MIT
// message: does not satisfy 'GridAccumulator'
import cilantro;

struct counter {
  int count = 0;
  void add(cilantro::index_t) { ++count; }
};

int main() {
  const Eigen::Matrix3Xf points(3, 10);
  return static_cast<int>(
      cilantro::accumulate(cilantro::voxel_grid{points, 1.0}, counter{}).size());
}
