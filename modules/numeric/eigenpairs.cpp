// SPDX-License-Identifier: MIT
module cilantro.numeric;

namespace cilantro {
namespace {

/// Below, the full decomposition is at least as fast.
constexpr index_t small = 300;
/// What is left of a unit vector that lies in a subspace but for rounding, at most.
constexpr double negligible = 1e-8;

void fix_signs(Eigen::MatrixXd& vectors) {
  for (auto column : vectors.colwise()) {
    index_t largest = 0;
    column.cwiseAbs().maxCoeff(&largest);
    if (column[largest] < 0) column = -column;
  }
}

eigenpairs failed() {
  return {.values = {}, .vectors = {}, .converged = false};
}

eigenpairs from_all(const Eigen::MatrixXd& matrix, index_t count) {
  const auto all = decompose_symmetric(matrix);
  if (!all.converged) return failed();
  eigenpairs found{.values = all.values.tail(count).reverse(),
                   .vectors = all.vectors.rightCols(count).rowwise().reverse()};
  fix_signs(found.vectors);
  return found;
}

using matrix_ref = Eigen::Ref<const Eigen::MatrixXd>;

// How Eigen cuts a product of matrices into blocks, and so its last bits, depends on the machine's
// caches and registers. A product with a vector is the same everywhere, and as fast where what
// stays of the matrix is near.

/// The largest strip of a matrix that stays near, in numbers.
constexpr index_t strip = 16'384;

void multiply_transposed(const matrix_ref& a, const matrix_ref& b,
                         Eigen::Ref<Eigen::MatrixXd> out) {
  const index_t width = std::max<index_t>(8, strip / std::max<index_t>(a.rows(), 1) / 8 * 8);
  for (index_t from = 0; from < a.cols(); from += width) {
    const index_t count = std::min(width, a.cols() - from);
    for (index_t c = 0; c < b.cols(); ++c)
      out.col(c).segment(from, count).noalias() = a.middleCols(from, count).transpose() * b.col(c);
  }
}

[[nodiscard]] Eigen::MatrixXd transposed_product(const matrix_ref& a, const matrix_ref& b) {
  Eigen::MatrixXd out(a.cols(), b.cols());
  multiply_transposed(a, b, out);
  return out;
}

[[nodiscard]] Eigen::MatrixXd product(const matrix_ref& a, const matrix_ref& b) {
  Eigen::MatrixXd out(a.rows(), b.cols());
  const index_t height = std::max<index_t>(64, strip / std::max<index_t>(a.cols(), 1) / 8 * 8);
  for (index_t from = 0; from < a.rows(); from += height) {
    const index_t count = std::min(height, a.rows() - from);
    for (index_t c = 0; c < b.cols(); ++c)
      out.col(c).segment(from, count).noalias() = a.middleRows(from, count) * b.col(c);
  }
  return out;
}

/// Some rows of matrix · in.
void multiply(const Eigen::MatrixXd& matrix, index_t row, index_t count, const matrix_ref& in,
              Eigen::Ref<Eigen::MatrixXd> out) {
  // By columns, which is how they lie in memory: it is symmetric.
  multiply_transposed(matrix.middleCols(row, count), in, out.middleRows(row, count));
}
void multiply(const sparse_matrix& matrix, index_t row, index_t count, const matrix_ref& in,
              Eigen::Ref<Eigen::MatrixXd> out) {
  const auto* start = matrix.outerIndexPtr();
  for (index_t i = row; i < row + count; ++i)
    for (index_t c = 0; c < in.cols(); ++c) {
      double sum = 0;
      for (auto k = start[i]; k < start[i + 1]; ++k)
        sum += matrix.valuePtr()[k] * in(matrix.innerIndexPtr()[k], c);
      out(i, c) = sum;
    }
}

/// A subspace that grows by blocks of products with the matrix, and shrinks to its best vectors.
template <class Matrix>
class block_lanczos {
 public:
  block_lanczos(const Matrix& matrix, index_t count, const eigenpair_options& options)
      : matrix_{matrix},
        options_{options},
        count_{count},
        block_{count + 2},
        room_{std::min(matrix.rows(), std::max(6 * block_, block_ + 40))},
        basis_(matrix.rows(), room_),
        image_(matrix.rows(), room_) {}

  [[nodiscard]] eigenpairs run() {
    Eigen::MatrixXd next(matrix_.rows(), block_);
    for (auto column : next.colwise()) column = any_vector();
    for (int restart = 0;; ++restart) {
      fill(std::move(next));
      Eigen::MatrixXd inner = transposed_product(basis_, image_);
      inner = (inner + inner.transpose()).eval() / 2;
      const auto ritz = decompose_symmetric(inner);
      if (!ritz.converged) return failed();

      const index_t kept = std::min(room_ - 1, std::max(block_, room_ / 2));
      const Eigen::MatrixXd best = ritz.vectors.rightCols(kept).rowwise().reverse();
      const Eigen::VectorXd values = ritz.values.tail(kept).reverse();
      basis_.leftCols(kept) = product(basis_, best);
      image_.leftCols(kept) = product(image_, best);
      size_ = kept;
      next = image_.leftCols(block_) - basis_.leftCols(block_) * values.head(block_).asDiagonal();
      const double scale = ritz.values.cwiseAbs().maxCoeff();
      if (next.leftCols(count_).colwise().norm().maxCoeff() <= options_.tolerance * scale) {
        eigenpairs found{.values = values.head(count_), .vectors = basis_.leftCols(count_)};
        fix_signs(found.vectors);
        return found;
      }
      if (restart == options_.max_restarts) return failed();
    }
  }

 private:
  Eigen::VectorXd any_vector() {
    random_stream random{0, drawn_++};
    Eigen::VectorXd v(matrix_.rows());
    for (double& x : v) x = random.uniform(-1, 1);
    return v;
  }

  /// Appends as many vectors as `some` has columns: these, made orthogonal to the basis and to each
  /// other. One that is in their span already is replaced by any other, which may lie in a part of
  /// the space that no product has reached.
  void append(Eigen::MatrixXd some) {
    const index_t first = size_;
    const auto before = basis_.leftCols(first);
    // Twice is enough (Kahan, as told by Parlett 1998, section 6.9), where the first time leaves
    // more than rounding; of what it does not, the rest would be parallel to the basis.
    for (int pass = 0; pass < 2; ++pass) {
      for (auto column : some.colwise())
        if (const double length = column.norm(); length > 0) column /= length;
      some -= product(before, transposed_product(before, some));
      for (auto column : some.colwise())
        if (!(column.norm() > negligible)) column.setZero();
    }
    for (index_t c = 0; c < some.cols(); ++c) {
      Eigen::VectorXd v = some.col(c);
      for (index_t from = first; !append_if_new(v, from); from = 0) v = any_vector().normalized();
    }
  }

  /// False if, but for rounding, v is in the span of the basis; of that the vectors before `from`
  /// are known to be orthogonal to v.
  bool append_if_new(Eigen::VectorXd& v, index_t from) {
    const auto others = basis_.middleCols(from, size_ - from);
    for (int pass = 0; pass < 2; ++pass) {
      v -= others * (others.transpose() * v);
      const double length = v.norm();
      if (!(length > negligible)) return false;
      v /= length;
    }
    basis_.col(size_++) = v;
    return true;
  }

  void fill(Eigen::MatrixXd next) {
    const execution how{options_.threads, {{}, options_.monitor.stop}};
    while (size_ < room_) {
      const index_t first = size_, width = std::min(block_, room_ - size_);
      append(next.leftCols(width));
      parallel_blocks(matrix_.rows(), 256, how, [&](index_t, index_t begin, index_t end) {
        multiply(matrix_, begin, end - begin, basis_.middleCols(first, width),
                 image_.middleCols(first, width));
      });
      next = image_.middleCols(first, width);
    }
  }

  const Matrix& matrix_;
  const eigenpair_options& options_;
  index_t count_, block_, room_, size_ = 0;
  Eigen::MatrixXd basis_, image_;  ///< Orthonormal vectors, and the matrix times each of them.
  std::uint64_t drawn_ = 0;
};

template <class Matrix>
eigenpairs largest(const Matrix& matrix, bool is_finite, index_t count,
                   const eigenpair_options& options) {
  expects(matrix.rows() == matrix.cols() && is_finite,
          "largest_eigenpairs: the matrix must be square and finite");
  expect_between(0, double(count), double(matrix.rows()), "largest_eigenpairs: the count");
  expect_from(0, options.max_restarts, "largest_eigenpairs: max_restarts");
  expect_from(0, options.tolerance, "largest_eigenpairs: tolerance");
  if (options.monitor.stop.stop_requested()) throw cancelled{};
  if (count == 0) return {.values = {}, .vectors = Eigen::MatrixXd(matrix.rows(), 0)};
  if (matrix.rows() <= small || 12 * (count + 2) > matrix.rows())
    return from_all(Eigen::MatrixXd{matrix}, count);
  return block_lanczos<Matrix>{matrix, count, options}.run();
}

}  // namespace

eigenpairs largest_eigenpairs(const Eigen::MatrixXd& matrix, index_t count,
                              const eigenpair_options& options) {
  return largest(matrix, matrix.allFinite(), count, options);
}

eigenpairs largest_eigenpairs(const sparse_matrix& matrix, index_t count,
                              const eigenpair_options& options) {
  expects(matrix.isCompressed(), "largest_eigenpairs: the matrix must be compressed");
  const Eigen::Map<const Eigen::VectorXd> values{matrix.valuePtr(), matrix.nonZeros()};
  return largest(matrix, values.allFinite(), count, options);
}

}  // namespace cilantro
