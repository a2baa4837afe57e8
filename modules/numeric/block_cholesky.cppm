// SPDX-License-Identifier: MIT
export module cilantro.numeric:block_cholesky;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// Which blocks of a symmetric matrix of N × N square blocks are stored: those on the diagonal, and
/// below it one for each link; column by column, by ascending row, the one on the diagonal first.
export class block_pattern {
 public:
  /// From the links between nodes, in either direction; a link that is given twice, and one of a
  /// node to itself, change nothing. Throws `invalid_input` for a node that there is not, and
  /// unless 0 <= nodes < 2³¹. O((nodes + links) log links).
  block_pattern(index_t nodes, std::span<const std::pair<std::int32_t, std::int32_t>> links);

  /// The number of nodes N.
  [[nodiscard]] index_t nodes() const { return std::ssize(offsets_) - 1; }
  /// The number of blocks that are stored.
  [[nodiscard]] index_t blocks() const { return std::ssize(rows_); }
  /// Where among all blocks those of each column begin, and at the end their number.
  [[nodiscard]] std::span<const index_t> offsets() const { return offsets_; }
  /// The row of each block.
  [[nodiscard]] std::span<const std::int32_t> rows() const { return rows_; }
  /// The place of the block (row, column) among all, or −1 if it is not stored, as those above the
  /// diagonal. O(log of the blocks in the column).
  [[nodiscard]] index_t slot(index_t row, index_t column) const;

 private:
  std::vector<index_t> offsets_;
  std::vector<std::int32_t> rows_;
};

/// In which order unknowns are eliminated, and what each of them changes.
struct elimination;

/// The factor of a matrix, as `block_cholesky` computes it.
export class block_factor {
 public:
  /// Of no unknowns.
  block_factor() = default;

  /// The number of unknowns.
  [[nodiscard]] index_t size() const { return size_; }

  /// The number of unknowns that the equations do not determine; they are 0 in all solutions.
  [[nodiscard]] index_t undetermined() const { return undetermined_; }

  /// Puts the solution in place of the right side. Unknowns that are determined solve their
  /// equations, with the others 0. Throws `invalid_input` unless the right side has `size()`
  /// numbers. A right side with a NaN or an infinity has a solution with NaN. Several threads may
  /// call it at once. O(numbers in the factor).
  void solve(std::span<double> right_side) const;
  void solve(Eigen::Ref<Eigen::VectorXd> right_side) const {
    solve(std::span{right_side.data(), static_cast<std::size_t>(right_side.size())});
  }

 private:
  friend class block_cholesky;

  std::shared_ptr<const elimination> order_;
  index_t size_ = 0, undetermined_ = 0;
  std::vector<double> factor_;
  /// What is only used while factorising, kept for the next time.
  std::vector<double> scratch_;
};

/// Solves sparse symmetric systems of blocks with the same pattern, one after the other: the order
/// of elimination and the pattern of the factor are computed once, and each factorisation reuses
/// them. Immutable: threads may share one, and copies cost nothing.
///
/// Matrices need not be definite. An unknown whose pivot, after elimination of those before it, is
/// at most 10⁻¹² times its entry on the diagonal, or not above 0, counts as undetermined: it stays
/// 0, and the others solve their equations with it.
///
/// About O(nodes^1.5) for nodes on a surface. The same bits with all vector targets.
///
/// Source: Amestoy, Davis & Duff 1996, "An approximate minimum degree ordering algorithm"; Duff &
/// Reid 1983, "The multifrontal solution of indefinite sparse symmetric linear equations".
export class block_cholesky {
 public:
  /// For blocks of `block_size` rows and columns; 3, 6 and 12 are fastest. Throws `invalid_input`
  /// unless 0 < block_size, and for more than 2³¹ − 1 unknowns.
  block_cholesky(block_pattern pattern, index_t block_size);

  /// The pattern that was given.
  [[nodiscard]] const block_pattern& pattern() const;
  /// The number of rows and columns of a block.
  [[nodiscard]] index_t block_size() const;
  /// The number of unknowns: nodes times `block_size()`.
  [[nodiscard]] index_t size() const;

  /// Factorises the matrix with these blocks: in the order of the pattern, each column by column;
  /// of those on the diagonal the lower triangle counts. Throws `invalid_input` for another number
  /// of values than `pattern().blocks()` times the squared block size, and for a NaN or an infinity
  /// among those that count.
  [[nodiscard]] block_factor factorize(std::span<const double> values) const;
  /// The same into an earlier factor, whose memory is used again. If it throws, the factor is one
  /// of no unknowns.
  void factorize(std::span<const double> values, block_factor& reused) const;

 private:
  std::shared_ptr<const elimination> order_;
};

}  // namespace cilantro
