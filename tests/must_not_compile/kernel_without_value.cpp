// SPDX-License-Identifier: MIT
// message: 'Kernel'
#include <vector>
import cilantro;

int main() {
  const std::vector<Eigen::Vector2f> points(3);
  const auto found = cilantro::mean_shift(points, 1.0, [](double) {});
  return static_cast<int>(found.size());
}
