// SPDX-License-Identifier: MIT
// message: 'RegistrationMetric<
import cilantro;

struct no_metric {
  double operator()(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const {
    return (a - b).norm();
  }
};

int main() {
  const Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Random(3, 10);
  const cilantro::deformation_graph graph{points, {.spacing = 1}};
  const cilantro::warp_estimator estimator{points, points, graph, no_metric{}};
}
