// SPDX-License-Identifier: MIT
// message: does not satisfy 'MotionModel'
import cilantro;

struct no_motion {
  template <class S, int D>
  using transform = cilantro::rigid_transform<S, D>;
};

int main() {
  const Eigen::Matrix3Xf points(3, 10);
  return cilantro::align<no_motion>(points, points, {.max_distance = 1}).iterations;
}
