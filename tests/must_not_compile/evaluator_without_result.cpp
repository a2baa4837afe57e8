// SPDX-License-Identifier: MIT
// message: 'PairWeight<
import cilantro;

int main() {
  const cilantro::neighborhoods<float> graph;
  const auto matrix =
      cilantro::pair_matrix(graph, [](cilantro::index_t, cilantro::index_t, float) {});
  return static_cast<int>(matrix.rows());
}
