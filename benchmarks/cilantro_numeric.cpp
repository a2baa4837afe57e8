// SPDX-License-Identifier: MIT
#include <algorithm>
#include <span>
#include <vector>

#include "block_system.hpp"
#include "common.hpp"

import cilantro;
using namespace cilantro;

/// A step of a loop that keeps its pattern.
void block_system_of(benchmark::State& state, int nodes) {
  const block_system system{nodes};
  const block_pattern pattern{nodes, system.links};
  constexpr index_t size = block_system::block * block_system::block;
  std::vector<double> values(pattern.blocks() * size);
  const auto put = [&](index_t row, index_t column, const block_system::values& v) {
    std::ranges::copy(v, values.begin() + pattern.slot(row, column) * size);
  };
  for (index_t i = 0; i < nodes; ++i) put(i, i, system.diagonal[i]);
  for (index_t k = 0; k < std::ssize(system.links); ++k)
    put(system.links[k].first, system.links[k].second, system.below[k]);
  const block_cholesky solver{pattern, block_system::block};
  block_factor factor;
  Eigen::VectorXd x;
  for (auto _ : state) {
    solver.factorize(values, factor);
    x = Eigen::VectorXd::Map(system.right_side.data(), std::ssize(system.right_side));
    factor.solve(x);
  }
  system.report(state, x.data());
}
