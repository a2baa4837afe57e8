// SPDX-License-Identifier: MIT
//
// Eigen's decompositions of matrices of doubles, compiled once for the whole library: each costs a
// unit that instantiates it seconds, and none of them is where time is spent when it runs.
export module cilantro.core:decompositions;

import cilantro.standard;
import cilantro.eigen;
import :points;

namespace cilantro {

/// A symmetric matrix by its eigenvalues, ascending, and eigenvectors, orthonormal, one per column.
export template <int D>
struct symmetric_decomposition {
  point_vector<double, D> values;
  Eigen::Matrix<double, D, D> vectors;
  bool converged = true;
};
/// For D of 2, 3 and dynamic. Precondition: the matrix is symmetric. O(D³).
export template <int D>
[[nodiscard]] symmetric_decomposition<D> decompose_symmetric(
    const Eigen::Matrix<double, D, D>& matrix);

/// A matrix as left · diag(values) · rightᵀ; values descending, both sides square.
export struct singular_decomposition {
  Eigen::VectorXd values;
  Eigen::MatrixXd left, right;
};
export [[nodiscard]] singular_decomposition decompose_singular(const Eigen::MatrixXd& matrix);

export [[nodiscard]] double determinant(const Eigen::MatrixXd& matrix);

/// The solution of matrix · x = b for each column of `right_sides`, or nothing if there is no
/// inverse.
export [[nodiscard]] std::optional<Eigen::MatrixXd> solve(const Eigen::MatrixXd& matrix,
                                                          const Eigen::MatrixXd& right_sides);
/// The same for a symmetric matrix, positive or negative semidefinite; in directions that a
/// singular one does not see, the solution is 0.
export [[nodiscard]] Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& matrix,
                                                     const Eigen::MatrixXd& right_sides);

export struct least_squares_solution {
  Eigen::MatrixXd unknowns;
  index_t rank;  ///< Of the matrix; pivots below `negligible` times the largest count as none.
};
/// Minimises ‖matrix · x − b‖ for each column of `right_sides`.
export [[nodiscard]] least_squares_solution solve_least_squares(const Eigen::MatrixXd& matrix,
                                                                const Eigen::MatrixXd& right_sides,
                                                                double negligible = 1e-14);

}  // namespace cilantro
