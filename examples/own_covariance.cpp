// SPDX-License-Identifier: MIT
//
// A covariance of your own for normals: neighbours count less the farther they are from the first
// one, the point itself. A lambda would do; a struct has a place for its options.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <optional>
#include <span>

import cilantro;
using namespace cilantro;

struct fading_covariance {
  double sigma;  ///< In the units of the points.

  template <Scalar S, int D>
  std::optional<moments<S, D>> operator()(points_view<S, D> points,
                                          std::span<const std::int32_t> near) const {
    moments<S, D> found{0, point_vector<S, D>::Zero(points.dimension()),
                        Eigen::Matrix<S, D, D>::Zero(points.dimension(), points.dimension())};
    const auto each = [&](auto use) {
      for (const auto i : near)
        if (is_finite(points[i]))
          use(points[i], gaussian{sigma}((points[i] - points[near.front()]).norm()));
    };
    S total = 0;
    each([&](const auto& p, S weight) {
      ++found.count;
      total += weight;
      found.mean += weight * p;
    });
    if (!(total > 0)) return std::nullopt;
    found.mean /= total;
    each([&](const auto& p, S weight) {
      const point_vector<S, D> difference = p - found.mean;
      found.covariance +=
          (weight / total * difference * difference.transpose()).template cast<double>();
    });
    return found;
  }
};
static_assert(CovarianceEstimator<fading_covariance, double, 3>);

int main() {
  // A roof: two planes that meet at x = 0.
  random_stream random{1};
  Eigen::Matrix3Xd roof(3, 4000);
  for (auto p : roof.colwise()) {
    p << random.uniform(-1, 1), random.uniform(-1, 1), 0;
    p.z() = -std::abs(p.x());
  }
  const auto violations = check_covariance_estimator(fading_covariance{0.05}, roof);
  for (const auto& violation : violations) std::cout << violation << '\n';

  const auto error = [&](const auto& found) {
    double sum = 0;
    for (index_t i = 0; i < roof.cols(); ++i) {
      const Eigen::Vector3d truth = Eigen::Vector3d{roof(0, i) < 0 ? -1.0 : 1.0, 0, 1}.normalized();
      sum += std::acos(std::min(1.0, std::abs(found.normals.col(i).dot(truth))));
    }
    return sum / double(roof.cols());
  };
  const double plain = error(estimate_normals(roof, knn{60}));
  const double fading = error(estimate_normals(roof, knn{60}, fading_covariance{0.05}));
  std::cout << "mean error of the normals: " << plain << " rad plain, " << fading
            << " rad fading\n";
  return violations.empty() && fading < plain ? 0 : 1;
}
