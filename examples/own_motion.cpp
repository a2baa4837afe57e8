// SPDX-License-Identifier: MIT
//
// A motion of your own: rotation, translation and one scale, for a scan in unknown units. With a
// `MotionModel`, every metric and every searcher works for it.
#include <cmath>
#include <iostream>

import cilantro;
import simulated_room;
using namespace cilantro;

/// The unknowns of `rigid_motion`, then the logarithm of the scale.
struct similarity_motion {
  template <Scalar S, int D>
  using transform = affine_transform<S, D>;

  static constexpr index_t unknowns(index_t d) { return rigid_motion::unknowns(d) + 1; }
  template <class V>
  static void pull_back(const V& y, const V& g, double* row) {
    rigid_motion::pull_back(y, g, row);
    row[unknowns(y.size()) - 1] = y.dot(g);
  }
  static motion_step step(const Eigen::VectorXd& unknowns, index_t d) {
    auto rigid = rigid_motion::step(unknowns.head(unknowns.size() - 1), d);
    rigid.linear *= std::exp(unknowns[unknowns.size() - 1]);
    return rigid;
  }
};
static_assert(MotionModel<similarity_motion>);

int main() {
  const auto violations = check_motion_model(similarity_motion{}, 3);
  for (const auto& violation : violations) std::cout << violation << '\n';

  const auto frame = simulate(0, {.width = 320, .height = 240});
  const point_cloud<double, 3> target{.points = frame.points, .normals = frame.normals};
  Eigen::Affine3d truth = Eigen::Translation3d{0.05, -0.03, 0.02} *
                          Eigen::AngleAxisd{0.03, Eigen::Vector3d::UnitZ()} *
                          Eigen::Affine3d::Identity();
  truth.linear() *= 1.04;
  const auto source = transform(target, truth.inverse()) | uniform_sample(5000);

  const auto found =
      align<similarity_motion>(source, target, {.max_distance = 0.5, .max_iterations = 100});
  const double scale = std::cbrt(found.transform.linear().determinant());
  std::cout << found.status << " after " << found.iterations << " iterations; the scale is "
            << scale << ", and is 1.04\n";
  return violations.empty() && found.converged() && std::abs(scale - 1.04) < 1e-3 ? 0 : 1;
}
