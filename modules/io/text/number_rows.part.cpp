// SPDX-License-Identifier: MIT
//
// The numbers of a text before anybody knows how many there are. Internal.
module cilantro.io:number_rows;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// Rows of as many numbers each, in blocks that stay where they are when more are added: nothing is
/// copied, and what is not written yet takes no memory.
class number_rows {
 public:
  /// Empties it, for rows of so many numbers, at least one.
  void reset(std::size_t columns) {
    columns_ = columns;
    blocks_.clear();
    shift_ = static_cast<int>(std::bit_width((block_numbers / columns) | 1)) - 1;
  }

  /// Makes room for `rows` rows. Those that were there keep their numbers, others have any.
  void resize(index_t rows) {
    const auto blocks = static_cast<std::size_t>((rows + block_rows() - 1) >> shift_);
    while (blocks_.size() < blocks)
      blocks_.push_back(std::make_unique_for_overwrite<double[]>(
          static_cast<std::size_t>(block_rows()) * columns_));
  }

  [[nodiscard]] double* operator[](index_t row) { return at(row); }
  [[nodiscard]] const double* operator[](index_t row) const { return at(row); }
  /// How many rows follow each other in memory, from row 0 on.
  [[nodiscard]] index_t block_rows() const { return index_t{1} << shift_; }

 private:
  static constexpr std::size_t block_numbers = std::size_t{1} << 17;

  [[nodiscard]] double* at(index_t row) const {
    const auto in_block = static_cast<std::size_t>(row & (block_rows() - 1));
    return blocks_[static_cast<std::size_t>(row >> shift_)].get() + in_block * columns_;
  }

  std::size_t columns_ = 1;
  int shift_ = 0;  // A block has 2 to the power of this rows.
  std::vector<std::unique_ptr<double[]>> blocks_;
};

}  // namespace cilantro
