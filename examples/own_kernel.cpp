// SPDX-License-Identifier: MIT
//
// A kernel of your own for mean shift: one that falls in a straight line to the edge.
#include <iostream>
#include <vector>

import cilantro;
using namespace cilantro;

struct triangle_kernel {
  static constexpr double support = 1;
  double operator()(double u) const { return u < 1 ? 1 - u : 0; }
};
static_assert(Kernel<triangle_kernel>);

int main() {
  const auto violations = check_kernel(triangle_kernel{});
  for (const auto& violation : violations) std::cout << violation << '\n';

  // Three groups along a line, the last as large as both others.
  Eigen::RowVectorXd positions(40);
  random_stream random{1};
  for (index_t i = 0; i < 40; ++i)
    positions[i] = (i < 10 ? 0 : i < 20 ? 5 : 10) + random.uniform(-1, 1);

  const auto found = mean_shift(positions, 2.0, triangle_kernel{});
  for (index_t c = 0; c < found.size(); ++c)
    std::cout << found[c].size() << " points around " << found.modes(0, c) << '\n';
  return violations.empty() && found.sizes() == std::vector<index_t>{20, 10, 10} ? 0 : 1;
}
