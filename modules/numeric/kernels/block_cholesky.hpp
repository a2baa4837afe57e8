// SPDX-License-Identifier: MIT
//
// What a block Cholesky factorisation does with one dense front, compiled for each vector target.
// Every number is the result of the same operations in the same order on all of them. Internal.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/vector_kernels.hpp"

namespace cilantro::detail {

/// Rows and columns of fronts come in strips of this many.
constexpr int front_strip = 8;

/// Some columns of a factor, and what their elimination changes behind them. The panel holds the
/// columns: first the square of their own rows, filled up with zeros to whole strips, then the rows
/// below, filled up as well. The update is a square of those rows; both are lower triangles.
struct front_shape {
  std::ptrdiff_t panel_stride, update_stride;
  int columns;
  int own_rows, rows_below;  ///< With those that fill up.
};

struct dense_front : front_shape {
  double* panel;
  double* update;
};

/// A block of the matrix, and where in a panel it goes.
struct placed_block {
  std::ptrdiff_t slot;
  std::int32_t row, column;
  bool is_transposed;
};

/// Rows of a child's update that follow each other in the panel of its parent, too.
struct row_run {
  std::int32_t from, to, length;
};

struct block_cholesky_kernels {
  /// Fills the panel with blocks of the matrix and zeros, and writes the pivots below which an
  /// unknown is undetermined. False if a value is not finite.
  bool (*assemble)(const dense_front& front, const placed_block* blocks, std::ptrdiff_t count,
                   int block, const double* values, double* least);
  /// Adds the update of a child: what belongs to the panel before it is eliminated, and what
  /// belongs to the update after that.
  void (*add_to_panel)(const dense_front& front, const row_run* runs, std::ptrdiff_t count,
                       const double* update, std::ptrdiff_t stride);
  /// Turns the panel into columns of the factor, with reciprocals on the diagonal, and writes what
  /// that changes as the update. Returns the number of columns that are undetermined; these are
  /// zero.
  int (*eliminate)(const dense_front& front, const double* least);
  void (*add_to_update)(const dense_front& front, const row_run* runs, std::ptrdiff_t count,
                        const double* update, std::ptrdiff_t stride);
  /// Both substitutions for one front, whose unknowns are the first of `own`, and whose rows below
  /// are those of the blocks `rows` of x. `work` has room for all rows.
  void (*forward)(const front_shape& front, const double* panel, double* own,
                  const std::int32_t* rows, int count, int block, double* x, double* work);
  void (*backward)(const front_shape& front, const double* panel, double* own,
                   const std::int32_t* rows, int count, int block, const double* x, double* work);
};

/// What the units for each target instantiate.
template <kernel_target V>
block_cholesky_kernels block_cholesky_kernels_in();

}  // namespace cilantro::detail
