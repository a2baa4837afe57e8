// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdint>
#include <initializer_list>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

Eigen::MatrixXd random_matrix(index_t rows, index_t columns, std::uint64_t seed) {
  random_stream random{seed};
  Eigen::MatrixXd m(rows, columns);
  for (auto& x : m.reshaped()) x = random.uniform(-1, 1);
  return m;
}

}  // namespace

TEST_CASE("decompositions multiply to the matrix, in their order") {
  for (const index_t n : {0, 1, 2, 3, 7}) {
    const Eigen::MatrixXd m = random_matrix(n, n, 1), symmetric_matrix = m + m.transpose();
    const auto axes = decompose_symmetric(symmetric_matrix);
    CHECK(axes.converged);
    CHECK((axes.vectors * axes.values.asDiagonal() * axes.vectors.transpose() - symmetric_matrix)
              .norm() < 1e-13);
    for (index_t k = 1; k < n; ++k) CHECK(axes.values[k - 1] <= axes.values[k]);
    if (n == 0) continue;
    const auto [values, left, right] = decompose_singular(m);
    CHECK((left * values.asDiagonal() * right.transpose() - m).norm() < 1e-13);
    CHECK(std::abs(determinant(m)) == doctest::Approx(values.prod()));
  }
  const auto fixed = decompose_symmetric(Eigen::Matrix3d{Eigen::Vector3d{3, 1, 2}.asDiagonal()});
  CHECK(fixed.values == Eigen::Vector3d{1, 2, 3});
}

TEST_CASE("solutions solve, and what has none is told") {
  const Eigen::MatrixXd m = random_matrix(4, 4, 2), b = random_matrix(4, 3, 3);
  CHECK((m * *solve(m, b) - b).norm() < 1e-12);
  CHECK(!solve(Eigen::MatrixXd::Ones(4, 4), b));
  const Eigen::MatrixXd positive_matrix = m * m.transpose();
  CHECK((positive_matrix * solve_symmetric(positive_matrix, b) - b).norm() < 1e-10);

  const Eigen::MatrixXd tall = random_matrix(9, 4, 4), c = random_matrix(9, 2, 5);
  const auto found = solve_least_squares(tall, c);
  CHECK(found.rank == 4);
  CHECK((tall.transpose() * (tall * found.unknowns - c)).norm() < 1e-12);
  Eigen::MatrixXd flat = tall;
  flat.col(3) = 2 * flat.col(0);
  CHECK(solve_least_squares(flat, c, 1e-12).rank == 3);
}
