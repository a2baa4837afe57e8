// SPDX-License-Identifier: MIT
#include "search/kernels/products.hpp"

#include "core/vectors.hpp"

namespace cilantro::detail::CILANTRO_VECTOR_TARGET {
namespace {

template <class S>
void tiles(const point_panels<S>& panels, std::ptrdiff_t begin, std::ptrdiff_t end,
           const S* const* queries, const S* limits, S* values, std::uint32_t* masks) {
  using lanes = vec<S, width>;
  static_assert(points_per_panel == 2 * width);
  for (std::ptrdiff_t panel = begin; panel < end; ++panel) {
    const S* points = panels.coordinates + panel * panels.dimension * points_per_panel;
    lanes low[queries_per_tile] = {}, high[queries_per_tile] = {};
    for (std::ptrdiff_t d = 0; d < panels.dimension; ++d) {
      const lanes first = load<lanes>(points + d * points_per_panel);
      const lanes second = load<lanes>(points + d * points_per_panel + width);
      for (int q = 0; q < queries_per_tile; ++q) {
        const lanes coordinate = queries[q][d];
        low[q] += coordinate * first;
        high[q] += coordinate * second;
      }
    }
    const lanes first = load<lanes>(panels.squares + panel * points_per_panel);
    const lanes second = load<lanes>(panels.squares + panel * points_per_panel + width);
    for (int q = 0; q < queries_per_tile; ++q) {
      const lanes a = first - 2 * low[q], b = second - 2 * high[q];
      store(values, a);
      store(values + width, b);
      *masks++ = bits(a <= limits[q]) | bits(b <= limits[q]) << width;
      values += points_per_panel;
    }
  }
}

}  // namespace
}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET

namespace cilantro::detail {

using namespace CILANTRO_VECTOR_TARGET;

template <kernel_target V, class S>
product_tiles<S>* product_tiles_in() {
  return tiles<S>;
}
template product_tiles<float>* product_tiles_in<this_target, float>();
template product_tiles<double>* product_tiles_in<this_target, double>();

}  // namespace cilantro::detail
