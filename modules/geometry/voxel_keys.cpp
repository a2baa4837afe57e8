// SPDX-License-Identifier: MIT
#include "geometry/voxel_keys.hpp"

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

template <class S>
void find_keys(const S* points, std::ptrdiff_t stride, const std::int32_t* indices,
               std::ptrdiff_t count, const key_layout& layout, keyed_index* out) {
  for (std::ptrdiff_t begin = 0; begin < count; begin += width) {
    const int size = static_cast<int>(smaller<std::ptrdiff_t>(width, count - begin));
    alignas(64) S places[most_key_axes][width] = {};
    for (int i = 0; i < size; ++i) {
      const S* p = points + indices[begin + i] * stride;
      for (int d = 0; d < layout.axes; ++d) places[d][i] = p[d];
    }
    vec<std::uint32_t, width> key = 0;
    for (int d = 0; d < layout.axes; ++d) {
      const numbers x = convert<numbers>(load<vec<S, width>>(places[d]));
      const integers step = floor_of((x - layout.origin[d]) / layout.edges[d]) - layout.low[d];
      key = key << static_cast<std::uint32_t>(layout.bits[d]) |
            __builtin_bit_cast(decltype(key), step);
    }
    for (int i = 0; i < size; ++i) out[begin + i] = {key[i], indices[begin + i]};
  }
}

}  // namespace

template <class S>
voxel_keys<S>* voxel_keys_in() {
  return find_keys<S>;
}
template voxel_keys<float>* voxel_keys_in<float>();
template voxel_keys<double>* voxel_keys_in<double>();

}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET
