// SPDX-License-Identifier: MIT
// message: in a container such as std::vector, not made on the way
#include <ranges>

import cilantro;

int main() {
  const auto scans = std::views::iota(0, 3) |
                     std::views::transform([](int) { return cilantro::point_cloud<float, 3>{}; });
  (void)cilantro::align_many(scans, {.voxel = 0.05});
}
