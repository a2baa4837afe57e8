// SPDX-License-Identifier: MIT
#include "geometry/kernels/voxel_keys.hpp"

#include "core/vectors.hpp"

namespace cilantro::detail::CILANTRO_VECTOR_TARGET {
namespace {

using numbers = vec<double, width>;
using integers = vec<std::int32_t, width>;

/// ⌊x⌋ for |x| < 2³¹, without the instruction for it, which the baseline has not.
CILANTRO_ALWAYS_INLINE integers floor_of(numbers x) {
  const integers toward_zero = convert<integers>(x);
  return toward_zero + convert<integers>(convert<numbers>(toward_zero) > x);
}

/// ⌊x / edge⌋. A product with the inverse is off by less than 2⁻⁵¹ of the quotient, so that its
/// floor is the same unless a whole number is as near as that; only then is there a division.
CILANTRO_ALWAYS_INLINE integers floor_of_quotient(numbers x, double edge, double inverse) {
  const numbers product = x * inverse;
  const integers floor = floor_of(product);
  const numbers above = product - convert<numbers>(floor);
  const numbers slack = __builtin_elementwise_abs(product) * 0x1p-50;
  if (bits((above <= slack) | (above >= 1 - slack)) == 0) return floor;
  return floor_of(x / edge);
}

template <class S>
void find_keys(const S* points, std::ptrdiff_t stride, const std::int32_t* indices,
               std::ptrdiff_t count, const key_layout& layout, std::uint32_t* out) {
  double inverse[most_key_axes] = {};
  for (int d = 0; d < layout.axes; ++d) inverse[d] = 1 / layout.edges[d];
  for (std::ptrdiff_t begin = 0; begin < count; begin += width) {
    const int size = static_cast<int>(smaller<std::ptrdiff_t>(width, count - begin));
    vec<S, width> places[most_key_axes];
    if (layout.axes == 3 && stride == 3 && size == width &&
        indices[begin + width - 1] - indices[begin] == width - 1) {
      load_by_axis(points + indices[begin] * std::ptrdiff_t{3}, places);
    } else {
      alignas(64) S room[most_key_axes][width] = {};
      for (int i = 0; i < size; ++i) {
        const S* p = points + indices[begin + i] * stride;
        for (int d = 0; d < layout.axes; ++d) room[d][i] = p[d];
      }
      for (int d = 0; d < layout.axes; ++d) places[d] = load<vec<S, width>>(room[d]);
    }
    vec<std::uint32_t, width> key = 0;
    for (int d = 0; d < layout.axes; ++d) {
      const numbers x = convert<numbers>(places[d]);
      const integers step =
          floor_of_quotient(x - layout.origin[d], layout.edges[d], inverse[d]) - layout.low[d];
      key = key << static_cast<std::uint32_t>(layout.bits[d]) |
            __builtin_bit_cast(decltype(key), step);
    }
    for (int i = 0; i < size; ++i) out[begin + i] = key[i];
  }
}

/// As many vectors at a time as there are axes: each lane then always holds the same axis.
template <class S, int Axes>
bool range_of(const S* points, std::ptrdiff_t count, S* lowest, S* highest) {
  using all = vec<S, width>;
  all low[Axes], high[Axes], difference = 0;
  for (int v = 0; v < Axes; ++v) {
    low[v] = S(__builtin_inf());
    high[v] = -S(__builtin_inf());
  }
  const std::ptrdiff_t whole = count / width * width;
  for (std::ptrdiff_t i = 0; i < whole; i += width) {
    for (int v = 0; v < Axes; ++v) {
      const all x = load<all>(points + i * Axes + v * width);
      low[v] = smaller(x, low[v]);
      high[v] = larger(x, high[v]);
      difference += x - x;
    }
  }
  S rest = 0, least[Axes], most[Axes];
  for (int d = 0; d < Axes; ++d) {
    least[d] = low[0][d];
    most[d] = high[0][d];
  }
  for (int k = 0; k < Axes * width; ++k) {
    least[k % Axes] = smaller(low[k / width][k % width], least[k % Axes]);
    most[k % Axes] = larger(high[k / width][k % width], most[k % Axes]);
  }
  for (int k = 0; k < width; ++k) rest += difference[k];
  for (std::ptrdiff_t k = whole * Axes; k < count * Axes; ++k) {
    least[k % Axes] = smaller(points[k], least[k % Axes]);
    most[k % Axes] = larger(points[k], most[k % Axes]);
    rest += points[k] - points[k];
  }
  if (!(rest == 0)) return false;
  for (int d = 0; d < Axes; ++d) {
    lowest[d] = least[d];
    highest[d] = most[d];
  }
  return true;
}

template <class S>
bool find_range(const S* points, int axes, std::ptrdiff_t count, S* low, S* high) {
  switch (axes) {
    case 1:
      return range_of<S, 1>(points, count, low, high);
    case 2:
      return range_of<S, 2>(points, count, low, high);
    case 3:
      return range_of<S, 3>(points, count, low, high);
    default:
      return false;
  }
}

}  // namespace
}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET

namespace cilantro::detail {

using namespace CILANTRO_VECTOR_TARGET;

template <kernel_target V, class S>
voxel_keys<S>* voxel_keys_in() {
  return find_keys<S>;
}
template <kernel_target V, class S>
finite_range<S>* finite_range_in() {
  return find_range<S>;
}
template voxel_keys<float>* voxel_keys_in<this_target, float>();
template voxel_keys<double>* voxel_keys_in<this_target, double>();
template finite_range<float>* finite_range_in<this_target, float>();
template finite_range<double>* finite_range_in<this_target, double>();

}  // namespace cilantro::detail
