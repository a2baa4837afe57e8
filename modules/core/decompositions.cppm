// SPDX-License-Identifier: MIT
//
// Eigen's decompositions of matrices of doubles, compiled once for the whole library: instantiating
// one takes the compiler seconds, and none of them matters for run time.
export module cilantro.core:decompositions;

import cilantro.standard;
import cilantro.eigen;
import :points;

namespace cilantro {

/// What `decompose_symmetric` returns.
export template <int D>
struct symmetric_decomposition {
  point_vector<double, D> values;       ///< Eigenvalues, ascending.
  Eigen::Matrix<double, D, D> vectors;  ///< Orthonormal eigenvectors, one per column.
  bool converged = true;                ///< Whether the iteration converged.
};
/// The eigenvalues and eigenvectors of a symmetric matrix. For D of 2, 3 and `dynamic`. Throws
/// `invalid_input` unless the matrix is square. Precondition: it is symmetric. O(D³).
export template <int D>
[[nodiscard]] symmetric_decomposition<D> decompose_symmetric(
    const Eigen::Matrix<double, D, D>& matrix);

/// The singular value decomposition of a matrix: left · diag(values) · rightᵀ.
export struct singular_decomposition {
  Eigen::VectorXd values;       ///< Singular values, descending.
  Eigen::MatrixXd left, right;  ///< Square and orthogonal.
};
export [[nodiscard]] singular_decomposition decompose_singular(const Eigen::MatrixXd& matrix);

/// The determinant. Throws `invalid_input` unless the matrix is square.
export [[nodiscard]] double determinant(const Eigen::MatrixXd& matrix);

/// The solution of matrix · x = b for each column of `right_sides`, or nothing if the matrix has no
/// inverse. Throws `invalid_input` unless it is square and `right_sides` has as many rows.
export [[nodiscard]] std::optional<Eigen::MatrixXd> solve(const Eigen::MatrixXd& matrix,
                                                          const Eigen::MatrixXd& right_sides);
/// As `solve`, for a symmetric matrix that is positive or negative semidefinite. If it is singular,
/// unknowns whose pivot vanishes are set to 0.
export [[nodiscard]] Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& matrix,
                                                     const Eigen::MatrixXd& right_sides);

/// What `solve_least_squares` returns.
export struct least_squares_solution {
  Eigen::MatrixXd unknowns;  ///< One column per column of the right sides.
  index_t rank;  ///< Of the matrix; pivots below `negligible` times the largest count as 0.
};
/// Minimises ‖matrix · x − b‖ for each column b of `right_sides`.
export [[nodiscard]] least_squares_solution solve_least_squares(const Eigen::MatrixXd& matrix,
                                                                const Eigen::MatrixXd& right_sides,
                                                                double negligible = 1e-14);

}  // namespace cilantro
