// SPDX-License-Identifier: MIT
// message: does not satisfy 'BorrowedPoints'
#include <array>
#include <vector>

import cilantro;

std::vector<std::array<float, 3>> scan();

int main() {
  const cilantro::brute_force_searcher<float, 3> searcher{scan()};
  return static_cast<int>(searcher.size());
}
