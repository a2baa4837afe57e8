// SPDX-License-Identifier: MIT
//
// A solver of your own: for scans that differ by a translation only, such as those of a gantry, one
// pair is a proposal. Each pair votes for a cell of translations, and the fullest cells are
// proposed.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <map>
#include <utility>
#include <vector>

import cilantro;
using namespace cilantro;

struct translation_votes {
  std::size_t most = 5;  // Proposals.

  std::vector<pair_proposal<3>> propose(const putative_pairs<3>& pairs,
                                        const execution& how) const {
    if (how.monitor.stop.stop_requested()) throw cancelled{};
    struct votes {
      index_t count = 0;
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    };
    std::map<std::array<std::int64_t, 3>, votes> cells;
    for (index_t i = 0; i < pairs.size(); ++i) {
      const Eigen::Vector3d shift = pairs.target.col(i) - pairs.source.col(i);
      std::array<std::int64_t, 3> cell;
      for (int d = 0; d < 3; ++d) cell[d] = std::llround(shift[d] / (2 * pairs.max_distance));
      ++cells[cell].count;
      cells[cell].sum += shift;
    }
    std::vector<std::pair<index_t, std::array<std::int64_t, 3>>> fullest;
    for (const auto& [cell, found] : cells) fullest.push_back({-found.count, cell});
    std::ranges::sort(fullest);
    std::vector<pair_proposal<3>> proposals;
    for (std::size_t k = 0; k < std::min(most, fullest.size()); ++k) {
      const auto& found = cells[fullest[k].second];
      proposals.push_back({.translation = found.sum / double(found.count)});
    }
    return proposals;
  }
};
static_assert(PairSolver<translation_votes, 3>);

int main() {
  random_stream random{1};
  Eigen::Matrix3Xd source(3, 2000), target(3, 2000);
  for (auto& x : source.reshaped()) x = random.uniform(0, 10);
  for (auto& x : target.reshaped()) x = random.uniform(0, 10);
  const Eigen::Vector3d truth{3, -1, 0.5};
  correspondences<double> pairs;
  for (int i = 0; i < 2000; ++i) {
    if (i % 20 == 0) target.col(i) = source.col(i) + truth;  // One pair of twenty is right.
    pairs.push_back({i, i, 0});
  }

  const putative_pairs<3> some{.source = source, .target = target, .max_distance = 0.05};
  const auto violations = check_pair_solver(translation_votes{}, some);
  for (const auto& violation : violations) std::cout << violation << '\n';
  const auto found =
      align_globally(source, target, pairs, {.max_distance = 0.05, .solver = translation_votes{}});
  std::cout << found << '\n';
  const bool is_found = (found.transform.translation() - truth).norm() < 1e-6;
  return violations.empty() && found.is_unique() && is_found ? 0 : 1;
}
