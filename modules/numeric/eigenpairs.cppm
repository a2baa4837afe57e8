// SPDX-License-Identifier: MIT
export module cilantro.numeric:eigenpairs;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// Some eigenvalues of a symmetric matrix, in descending order, and their eigenvectors.
export struct eigenpairs {
  Eigen::VectorXd values;  ///< Eigenvalues, descending.
  /// Orthonormal, one per column; the entry of largest magnitude in each is positive.
  Eigen::MatrixXd vectors;
  /// Whether the iteration converged. If not, there are no values and no vectors.
  bool converged = true;
};

/// Options of `largest_eigenpairs`.
export struct eigenpair_options {
  int max_restarts = 1000;   ///< Of the iteration, for matrices that are not small.
  double tolerance = 1e-10;  ///< Of a residual ‖Av − λv‖, relative to the largest |λ|.
  int threads = 0;
  task_monitor monitor = {};  ///< Only its `stop` is used; no progress is reported.
};

/// A sparse matrix of doubles, row by row.
export using sparse_matrix = Eigen::SparseMatrix<double, Eigen::RowMajor, std::int32_t>;

/// The `count` algebraically largest eigenvalues of a symmetric matrix, with their eigenvectors. If
/// the matrix is small, or nearly all pairs are wanted, they come from the full decomposition in
/// O(N³); otherwise from a restarted block Lanczos iteration, which only multiplies by the matrix.
/// Its blocks are wider than `count`, so that equal or nearly equal eigenvalues are all found. The
/// same bits for any number of threads. Throws `invalid_input` for a matrix that is not square or
/// not finite, for a sparse one that is not compressed, and unless 0 <= count <= N; throws
/// `cancelled`. Precondition: the matrix is symmetric.
/// Source: Wu & Simon 2000, "Thick-restart Lanczos method for large symmetric eigenvalue problems";
/// in blocks as Golub & Underwood 1977, "The block Lanczos method for computing eigenvalues".
export [[nodiscard]] eigenpairs largest_eigenpairs(const Eigen::MatrixXd& matrix, index_t count,
                                                   const eigenpair_options& options = {});
export [[nodiscard]] eigenpairs largest_eigenpairs(const sparse_matrix& matrix, index_t count,
                                                   const eigenpair_options& options = {});

}  // namespace cilantro
