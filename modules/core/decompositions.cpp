// SPDX-License-Identifier: MIT
module cilantro.core;

namespace cilantro {

template <int D>
symmetric_decomposition<D> decompose_symmetric(const Eigen::Matrix<double, D, D>& matrix) {
  expects(matrix.rows() == matrix.cols(), "decompose_symmetric: the matrix must be square");
  if (matrix.size() == 0) return {point_vector<double, D>{matrix.rows()}, matrix};
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, D, D>> solver{matrix};
  return {solver.eigenvalues(), solver.eigenvectors(), solver.info() == Eigen::Success};
}
template symmetric_decomposition<2> decompose_symmetric(const Eigen::Matrix2d&);
template symmetric_decomposition<3> decompose_symmetric(const Eigen::Matrix3d&);
template symmetric_decomposition<dynamic> decompose_symmetric(const Eigen::MatrixXd&);

singular_decomposition decompose_singular(const Eigen::MatrixXd& matrix) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd{matrix, Eigen::ComputeFullU | Eigen::ComputeFullV};
  return {svd.singularValues(), svd.matrixU(), svd.matrixV()};
}

double determinant(const Eigen::MatrixXd& matrix) {
  expects(matrix.rows() == matrix.cols(), "determinant: the matrix must be square");
  return matrix.determinant();
}

namespace {

void expect_system(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right_sides,
                   bool is_square) {
  expects(matrix.rows() == right_sides.rows() && (!is_square || matrix.rows() == matrix.cols()),
          "solve: the sizes of matrix and right sides do not match");
}

// Column by column: how Eigen cuts a solution for several into blocks depends on the machine.
Eigen::MatrixXd solve_columns(const auto& factors, const Eigen::MatrixXd& right_sides) {
  Eigen::MatrixXd unknowns(factors.cols(), right_sides.cols());
  for (index_t k = 0; k < right_sides.cols(); ++k)
    unknowns.col(k) = factors.solve(right_sides.col(k));
  return unknowns;
}

}  // namespace

std::optional<Eigen::MatrixXd> solve(const Eigen::MatrixXd& matrix,
                                     const Eigen::MatrixXd& right_sides) {
  expect_system(matrix, right_sides, true);
  const Eigen::FullPivLU<Eigen::MatrixXd> factors{matrix};
  if (!factors.isInvertible()) return std::nullopt;
  return solve_columns(factors, right_sides);
}

Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right_sides) {
  expect_system(matrix, right_sides, true);
  const Eigen::LDLT<Eigen::MatrixXd> factors{matrix};
  return solve_columns(factors, right_sides);
}

least_squares_solution solve_least_squares(const Eigen::MatrixXd& matrix,
                                           const Eigen::MatrixXd& right_sides, double negligible) {
  expect_system(matrix, right_sides, false);
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factors;
  factors.setThreshold(negligible);
  factors.compute(matrix);
  return {solve_columns(factors, right_sides), factors.rank()};
}

}  // namespace cilantro
