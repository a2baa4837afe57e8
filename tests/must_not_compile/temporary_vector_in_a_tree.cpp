// SPDX-License-Identifier: MIT
// message: does not satisfy 'BorrowedPoints'
#include <array>
#include <vector>

import cilantro;

std::vector<std::array<float, 3>> scan();

int main() {
  const cilantro::kd_tree<float, 3> tree{scan()};
  return static_cast<int>(tree.size());
}
