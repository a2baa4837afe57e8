// SPDX-License-Identifier: MIT
// message: invalid operands to binary expression ('neighborhood<float>'
#include <ranges>
#include <vector>
import cilantro;

int main() {
  const std::vector<Eigen::Vector2f> points(3);
  const cilantro::kd_tree tree{points};
  const auto near = cilantro::find_neighborhoods(tree, points, cilantro::knn{2});
  for (const auto i : near[0] | std::views::transform(&cilantro::neighbor<float>::index))
    return static_cast<int>(i);
}
