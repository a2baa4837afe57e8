// SPDX-License-Identifier: MIT
// message: SimilarityFunction
#include <vector>
import cilantro;

int main() {
  const std::vector<Eigen::Vector2f> points(3);
  const auto found = cilantro::connected_components(
      points, cilantro::knn{2}, [](cilantro::index_t, cilantro::index_t, float) {});
  return static_cast<int>(found.size());
}
