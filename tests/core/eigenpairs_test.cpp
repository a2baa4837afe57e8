// SPDX-License-Identifier: MIT
#include <string>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

TEST_CASE("eigenpairs of large matrices are those of the full decomposition, dense and sparse") {
  Eigen::MatrixXd a = test::random_points<test::space<double, dynamic>>(400).transpose();
  Eigen::MatrixXd m = a * a.transpose();
  m.diagonal() += Eigen::VectorXd::LinSpaced(400, 0, 1);
  const auto found = largest_eigenpairs(m, 5);
  REQUIRE(found.converged);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> full{m};
  for (index_t k = 0; k < 5; ++k) {
    CHECK(found.values[k] == doctest::Approx(full.eigenvalues()[399 - k]).epsilon(1e-9));
    CHECK((m * found.vectors.col(k) - found.values[k] * found.vectors.col(k)).norm() < 1e-6);
  }
  CHECK((found.vectors.transpose() * found.vectors).isIdentity(1e-9));
  const sparse_matrix sparse = m.sparseView();
  CHECK(largest_eigenpairs(sparse, 5).values.isApprox(found.values, 1e-9));
  CHECK(largest_eigenpairs(m, 5, {.threads = 5}).vectors ==
        largest_eigenpairs(m, 5, {.threads = 1}).vectors);
  CHECK(largest_eigenpairs(m, 0).values.size() == 0);
  // Of equal eigenvalues one is not taken for several, nor several for one.
  Eigen::MatrixXd twice = Eigen::MatrixXd::Zero(800, 800);
  twice.topLeftCorner(400, 400) = twice.bottomRightCorner(400, 400) = m;
  const auto pairs = largest_eigenpairs(twice, 6);
  REQUIRE(pairs.converged);
  for (index_t k = 0; k < 6; ++k)
    CHECK(pairs.values[k] == doctest::Approx(full.eigenvalues()[399 - k / 2]).epsilon(1e-9));
  CHECK(largest_eigenpairs(Eigen::MatrixXd::Identity(500, 500), 4).values.isOnes(1e-9));
  CHECK(!largest_eigenpairs(m, 5, {.max_restarts = 0}).converged);
  CHECK_THROWS_AS((void)largest_eigenpairs(m, 401), invalid_input);
  CHECK_THROWS_AS((void)largest_eigenpairs(m.leftCols(3).eval(), 1), invalid_input);
}
