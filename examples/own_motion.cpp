// SPDX-License-Identifier: MIT
//
// A motion of your own: a scanner that stands upright turns about the vertical only. With a
// `MotionModel`, every metric and every searcher works for it, and the vertical stays exact.
#include <cmath>
#include <iostream>

import cilantro;
import simulated_room;
using namespace cilantro;

/// The angle about z in radians, then the translation.
struct upright_motion {
  template <Scalar S, int D>
  using transform = rigid_transform<S, D>;

  static constexpr index_t unknowns(index_t d) { return 1 + d; }
  template <class V>
  static void pull_back(const V& y, const V& g, double* row) {
    row[0] = y[0] * g[1] - y[1] * g[0];
    for (index_t i = 0; i < y.size(); ++i) row[1 + i] = g[i];
  }
  static motion_step step(const Eigen::VectorXd& unknowns, index_t d) {
    Eigen::VectorXd all = Eigen::VectorXd::Zero(rigid_motion::unknowns(d));
    all.tail(d + 1) = unknowns;  // The rotation about z is the last one.
    return rigid_motion::step(all, d);
  }
};
static_assert(MotionModel<upright_motion>);

int main() {
  const auto violations = check_motion_model(upright_motion{}, 3);
  for (const auto& violation : violations) std::cout << violation << '\n';

  const auto frame = simulate(0, {.width = 320, .height = 240});
  const point_cloud<double, 3> target{.points = frame.points, .normals = frame.normals};
  const Eigen::Isometry3d truth = Eigen::Translation3d{0.05, -0.03, 0.02} *
                                  Eigen::AngleAxisd{0.04, Eigen::Vector3d::UnitZ()} *
                                  Eigen::Isometry3d::Identity();
  const auto source = transform(target, truth.inverse()) | uniform_sample(5000);

  const auto found =
      align<upright_motion>(source, target, {.max_distance = 0.5, .max_iterations = 100});
  const double angle = std::atan2(found.transform(1, 0), found.transform(0, 0));
  const double tilt = (found.transform.linear().col(2) - Eigen::Vector3d::UnitZ()).norm();
  std::cout << found.status << " with " << found.unknowns << " unknowns; turned by " << angle
            << ", and in truth by 0.04; tilted by " << tilt << '\n';
  return violations.empty() && found.converged() && std::abs(angle - 0.04) < 1e-3 && tilt < 1e-12
             ? 0
             : 1;
}
