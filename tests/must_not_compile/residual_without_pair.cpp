// SPDX-License-Identifier: MIT
// message: 'RegistrationMetric<
import cilantro;

struct no_metric {
  double operator()(double distance) const { return distance; }
};

int main() {
  const Eigen::Matrix3Xf points(3, 10);
  return cilantro::align(points, points, no_metric{}, {.max_distance = 1}).iterations;
}
