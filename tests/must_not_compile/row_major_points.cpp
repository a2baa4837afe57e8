// SPDX-License-Identifier: MIT
// message: does not satisfy 'CoordinatesAreAdjacent'
import cilantro;

int main() {
  const Eigen::Matrix<float, 3, cilantro::dynamic, Eigen::RowMajor> points(3, 10);
  return static_cast<int>(cilantro::count_non_finite(points));
}
