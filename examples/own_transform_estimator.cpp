// SPDX-License-Identifier: MIT
//
// A transform estimator of your own: only a translation, by the median of the differences of the
// pairs in each coordinate, which nearly half of them cannot spoil.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <span>
#include <vector>

import cilantro;
using namespace cilantro;

struct median_shift {
  using transform_type = Eigen::Isometry3d;
  const Eigen::Matrix3Xd& source;
  const Eigen::Matrix3Xd& target;

  registration_step<Eigen::Isometry3d> estimate(
      const Eigen::Isometry3d& current, std::span<const correspondence<double>> pairs) const {
    registration_step<Eigen::Isometry3d> step{current, {}, {}};
    step.fit.pairs = std::ssize(pairs);
    if (pairs.empty()) return step;
    Eigen::Vector3d shift;
    std::vector<double> differences;
    for (int d = 0; d < 3; ++d) {
      differences.clear();
      for (const auto& [s, t, distance] : pairs)
        differences.push_back(target(d, t) - (current * source.col(s))[d]);
      const auto middle = differences.begin() + std::ssize(differences) / 2;
      std::ranges::nth_element(differences, middle);
      shift[d] = *middle;
    }
    step.transform.pretranslate(shift);
    step.change.translation = shift.norm();
    step.fit.overlap = double(pairs.size()) / double(source.cols());
    return step;
  }
};
static_assert(TransformEstimator<median_shift, correspondences<double>>);

int main() {
  random_stream random{1};
  Eigen::Matrix3Xd target(3, 500);
  for (auto& x : target.reshaped()) x = random.uniform(-1, 1);
  const Eigen::Vector3d truth{0.05, -0.03, 0.02};
  Eigen::Matrix3Xd source = target.colwise() - truth;
  source.leftCols(200).array() += 0.3;  // Two fifths have gone elsewhere.

  const median_shift estimator{source, target};
  std::vector<correspondence<double>> pairs;
  for (int i = 0; i < 500; ++i) pairs.push_back({i, i, 0});
  const auto violations =
      check_transform_estimator(estimator, Eigen::Isometry3d::Identity(), pairs);
  for (const auto& violation : violations) std::cout << violation << '\n';
  const known_pairs_searcher searcher{source, target, pairs};
  const auto found = icp(searcher, estimator, Eigen::Isometry3d::Identity(), {});
  const auto mean = icp(searcher, point_to_point_estimator{source, target});
  const auto error = [&](const auto& result) {
    return (result.transform.translation() - truth).norm();
  };
  std::cout << "off by " << error(found) << " with medians, by " << error(mean) << " with means\n";
  return violations.empty() && found.converged() && error(found) < 0.02 && error(mean) > 0.05 ? 0
                                                                                              : 1;
}
