// SPDX-License-Identifier: MIT
//
// A family of models of your own: parabolas y = a x² + b x + c, such as the way of a thrown ball,
// among points that are not of it.
#include <cmath>
#include <cstdint>
#include <iostream>
#include <optional>
#include <span>

import cilantro;
using namespace cilantro;

struct parabolas {
  using model_type = Eigen::Vector3d;  // a, b and c.
  const Eigen::Matrix2Xd& points;

  index_t size() const { return points.cols(); }
  index_t sample_size() const { return 3; }

  /// Through a sample, and of least squares through more.
  std::optional<model_type> fit(std::span<const std::int32_t> indices) const {
    Eigen::MatrixX3d powers(std::ssize(indices), 3);
    Eigen::VectorXd heights(std::ssize(indices));
    for (index_t k = 0; k < heights.size(); ++k) {
      const double x = points(0, indices[std::size_t(k)]);
      powers.row(k) << x * x, x, 1;
      heights[k] = points(1, indices[std::size_t(k)]);
    }
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver{powers};
    if (solver.rank() < 3) return std::nullopt;
    return solver.solve(heights);
  }

  double residual(const model_type& m, index_t i) const {
    const double x = points(0, i);
    return std::abs(m[0] * x * x + m[1] * x + m[2] - points(1, i));
  }
};
static_assert(ModelFamily<parabolas>);

int main() {
  Eigen::Matrix2Xd points(2, 200);
  random_stream random{3};
  for (index_t i = 0; i < 200; ++i) {
    const double x = random.uniform(-1, 1);
    const double y =
        i % 2 == 0 ? -2 * x * x + 0.5 * x + 1 + 0.01 * random.normal() : random.uniform(-2, 2);
    points.col(i) << x, y;
  }
  const parabolas family{points};
  const auto violations = check_model_family(family, 1e-9);
  for (const auto& violation : violations) std::cout << violation << '\n';

  const auto found = ransac(family, {.max_residual = 0.03});
  if (!found) return 1;
  std::cout << found->inliers.size() << " points lie on y = " << found->model[0] << " x^2 + "
            << found->model[1] << " x + " << found->model[2] << ", found after "
            << found->iterations << " samples\n";
  const bool is_right = (found->model - Eigen::Vector3d{-2, 0.5, 1}).norm() < 0.05;
  return violations.empty() && is_right ? 0 : 1;
}
