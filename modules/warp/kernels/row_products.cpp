// SPDX-License-Identifier: MIT
#include "warp/kernels/row_products.hpp"

#include "core/vectors.hpp"

namespace cilantro::detail::CILANTRO_VECTOR_TARGET {
namespace {

constexpr int tile = static_cast<int>(row_padding);
using numbers = vec<double, tile>;

/// The products of the columns from `a` on with the columns from `b` on, in registers.
CILANTRO_ALWAYS_INLINE void sum_tile(const weighted_row_list& list, std::ptrdiff_t a,
                                     std::ptrdiff_t b, double* products) {
  numbers sums[tile] = {};
  const double* row = list.rows;
  for (std::ptrdiff_t r = 0; r < list.count; ++r, row += list.width) {
    const auto right = load<numbers>(row + b);
    for (int i = 0; i < tile; ++i) sums[i] += row[a + i] * right;
  }
  for (int i = 0; i < tile; ++i) store(products + (a + i) * list.width + b, sums[i]);
}

void sum_products(const weighted_row_list& list, double* products, double* gradient) {
  for (std::ptrdiff_t b = 0; b < list.width; b += tile) {
    for (std::ptrdiff_t a = 0; a <= b; a += tile) sum_tile(list, a, b, products);
    numbers sum = 0;
    for (std::ptrdiff_t r = 0; r < list.count; ++r)
      sum += list.values[r] * load<numbers>(list.rows + r * list.width + b);
    store(gradient + b, sum);
  }
}

}  // namespace
}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET

namespace cilantro::detail {

using namespace CILANTRO_VECTOR_TARGET;

template <kernel_target V>
row_products* row_products_in() {
  return sum_products;
}
template row_products* row_products_in<this_target>();

}  // namespace cilantro::detail
