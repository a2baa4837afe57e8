// SPDX-License-Identifier: MIT
// message: 'CovarianceEstimator<
import cilantro;

int main() {
  const Eigen::Matrix3Xf points(3, 10);
  const auto found =
      cilantro::mean_and_covariance(points, [](cilantro::points_view<float, 3>) { return 1; });
  return found ? 0 : 1;
}
