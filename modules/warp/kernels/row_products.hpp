// SPDX-License-Identifier: MIT
//
// Sums of the outer products of rows, for normal equations of a few dozen unknowns, compiled for
// each vector target. Internal.
#pragma once

#include <cstddef>

#include "core/vector_kernels.hpp"

namespace cilantro::detail {

/// Rows are padded with zeros to a multiple of this many numbers.
inline constexpr std::ptrdiff_t row_padding = 8;

/// `count` rows of `width` numbers, a multiple of `row_padding`, and a value for each.
struct weighted_row_list {
  const double* rows;
  const double* values;
  std::ptrdiff_t count, width;
};

/// Writes Σ rowᵀ row to `products`, `width` × `width`, of which only the tiles of 8 × 8 on and
/// above the diagonal are written, row by row; and Σ value · row to `gradient`.
using row_products = void(const weighted_row_list& list, double* products, double* gradient);

/// What the units for each target instantiate.
template <kernel_target V>
row_products* row_products_in();

}  // namespace cilantro::detail
