// SPDX-License-Identifier: MIT
export module cilantro.numeric:eigenpairs;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// Some eigenvalues of a symmetric matrix, in descending order, and their eigenvectors.
export struct eigenpairs {
  Eigen::VectorXd values;
  /// Orthonormal, one per column; of each, the entry of largest magnitude is positive.
  Eigen::MatrixXd vectors;
  /// Whether the iteration ended. If not, there are no values and no vectors.
  bool converged = true;
};

export struct eigenpair_options {
  int max_restarts = 1000;   ///< Of the iteration, for matrices that are not small.
  double tolerance = 1e-10;  ///< Of a residual ‖Av − λv‖, relative to the largest |λ|.
  int threads = 0;
  task_monitor monitor = {};  ///< Stops; there is no progress to tell.
};

export using sparse_matrix = Eigen::SparseMatrix<double, Eigen::RowMajor, std::int32_t>;

/// The `count` algebraically largest eigenvalues of a symmetric matrix with their eigenvectors; of
/// a small matrix, or nearly all of its pairs, from the full decomposition in O(N³), otherwise by
/// a restarted block Lanczos iteration, which only multiplies by the matrix; since blocks are as
/// wide as `count`, eigenvalues that are equal or nearly so are all found. The same bits
/// for any number of threads. Throws `invalid_input` for a matrix that is not square or has a
/// number that is not finite, and unless 0 <= count <= N; `cancelled`. Precondition: the matrix is
/// symmetric.
/// Source: Wu & Simon 2000, "Thick-restart Lanczos method for large symmetric eigenvalue problems";
/// in blocks as Golub & Underwood 1977, "The block Lanczos method for computing eigenvalues".
export [[nodiscard]] eigenpairs largest_eigenpairs(const Eigen::MatrixXd& matrix, index_t count,
                                                   const eigenpair_options& options = {});
export [[nodiscard]] eigenpairs largest_eigenpairs(const sparse_matrix& matrix, index_t count,
                                                   const eigenpair_options& options = {});

}  // namespace cilantro
