// SPDX-License-Identifier: MIT
// message: searcher.find(query, spec, out)' would be invalid
import cilantro;

struct my_searcher {
  using scalar = float;
  static constexpr int static_dimension = 3;
  [[nodiscard]] long size() const { return 0; }
  [[nodiscard]] long dimension() const { return 3; }
};

int main() {
  const Eigen::Matrix3Xf points(3, 10);
  return static_cast<int>(
      cilantro::find_neighborhoods(my_searcher{}, points, cilantro::knn{3}).size());
}
