// SPDX-License-Identifier: MIT
//
// What two right pairs share, of your own: beside lengths, the brightness of their points. Of a
// pattern that repeats, half of the pairs are on the wrong copy, and only their brightness tells.
#include <cmath>
#include <iostream>
#include <vector>

import cilantro;
using namespace cilantro;

struct equal_brightness {
  const std::vector<double>&source, &target;  // Of both points of each given pair.
  equal_lengths lengths = {};

  template <int D>
  bool operator()(const putative_pair<D>& a, const putative_pair<D>& b,
                  const putative_pairs<D>& all) const {
    const auto alike = [&](index_t i) { return std::abs(source[i] - target[i]) < 0.1; };
    return alike(a.index) && alike(b.index) && lengths(a, b, all);
  }
};
static_assert(PairInvariant<equal_brightness, 3>);

int main() {
  random_stream random{1};
  Eigen::Matrix3Xd source(3, 400), target(3, 400);
  for (auto& x : source.reshaped()) x = random.uniform(0, 1);
  const Eigen::Isometry3d right{Eigen::Translation3d{2, 0, 1} *
                                Eigen::AngleAxisd{1, Eigen::Vector3d::UnitZ()}};
  const Eigen::Isometry3d wrong = Eigen::Translation3d{0, 0.5, 0} * right;
  std::vector<double> here(400), there(400);
  correspondences<double> pairs;
  for (int i = 0; i < 400; ++i) {
    const bool is_right = i % 2 == 0;
    target.col(i) = (is_right ? right : wrong) * source.col(i);
    here[i] = random.uniform(0, 0.5);
    there[i] = is_right ? here[i] : here[i] + 0.5;
    pairs.push_back({i, i, 0});
  }

  const equal_brightness invariant{here, there};
  const auto violations = check_pair_invariant(
      invariant, putative_pairs<3>{.source = source, .target = target, .max_distance = 0.02});
  for (const auto& violation : violations) std::cout << violation << '\n';
  const auto by_lengths = align_globally(source, target, pairs, {.max_distance = 0.02});
  const auto found = align_globally(source, target, pairs,
                                    {.max_distance = 0.02, .solver = pair_graph{invariant}});
  std::cout << "by lengths:    " << by_lengths << "\nby brightness: " << found << '\n';
  const bool only_brightness_tells = by_lengths.status == global_status::ambiguous &&
                                     found.is_unique() && found.transform.isApprox(right, 1e-6);
  return violations.empty() && only_brightness_tells ? 0 : 1;
}
