// SPDX-License-Identifier: MIT
//
// What vector kernels are written in: the compiler's own vectors, which it maps to whatever the
// target has. Internal, and for the units that CMake compiles once for each target. They must hold
// nothing but functions of their own, none of the standard library: the linker keeps one copy of
// an inline function, which might be one that the machine at hand cannot run.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/vector_kernels.hpp"

#define CILANTRO_ALWAYS_INLINE inline __attribute__((always_inline))

namespace cilantro::detail::CILANTRO_VECTOR_TARGET {

/// The target that this unit is compiled for.
constexpr auto this_target = kernel_target::CILANTRO_VECTOR_TARGET;

namespace {

template <class T, int N>
using vec __attribute__((ext_vector_type(N))) = T;

/// Points are stored, and queries answered, in blocks of this many.
constexpr int width = 16;

/// The second, if they are equal or one is NaN.
template <class V>
CILANTRO_ALWAYS_INLINE V smaller(V a, V b) {
  return a < b ? a : b;
}
template <class V>
CILANTRO_ALWAYS_INLINE V larger(V a, V b) {
  return a > b ? a : b;
}

template <class V>
CILANTRO_ALWAYS_INLINE V magnitude(V v) {
  return v < 0 ? -v : v;
}

template <class V, class T>
CILANTRO_ALWAYS_INLINE V load(const T* from) {
  V v;
  __builtin_memcpy(&v, from, sizeof v);
  return v;
}
template <class T, class V>
CILANTRO_ALWAYS_INLINE void store(T* to, V v) {
  __builtin_memcpy(to, &v, sizeof v);
}
template <class To, class From>
CILANTRO_ALWAYS_INLINE To convert(From v) {
  return __builtin_convertvector(v, To);
}

/// Sixteen points of three packed coordinates, an axis each.
template <class S>
CILANTRO_ALWAYS_INLINE void load_by_axis(const S* points, vec<S, width>* axes) {
  using all = vec<S, width>;
  const all a = load<all>(points), b = load<all>(points + width), c = load<all>(points + 2 * width);
  const all x =
      __builtin_shufflevector(a, b, 0, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30, -1, -1, -1, -1, -1);
  const all y =
      __builtin_shufflevector(a, b, 1, 4, 7, 10, 13, 16, 19, 22, 25, 28, 31, -1, -1, -1, -1, -1);
  const all z =
      __builtin_shufflevector(a, b, 2, 5, 8, 11, 14, 17, 20, 23, 26, 29, -1, -1, -1, -1, -1, -1);
  axes[0] = __builtin_shufflevector(x, c, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 17, 20, 23, 26, 29);
  axes[1] = __builtin_shufflevector(y, c, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 18, 21, 24, 27, 30);
  axes[2] = __builtin_shufflevector(z, c, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 16, 19, 22, 25, 28, 31);
}

/// Vectors of three coordinates, one in each lane.
template <class V>
struct triple {
  V x, y, z;
};
template <class V>
CILANTRO_ALWAYS_INLINE V dot(const triple<V>& a, const triple<V>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class V>
CILANTRO_ALWAYS_INLINE triple<V> cross(const triple<V>& a, const triple<V>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class V>
CILANTRO_ALWAYS_INLINE triple<V> operator-(const triple<V>& a, const triple<V>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class V>
CILANTRO_ALWAYS_INLINE triple<V> operator*(const triple<V>& a, V by) {
  return {a.x * by, a.y * by, a.z * by};
}
template <class V, class Comparison>
CILANTRO_ALWAYS_INLINE triple<V> choose(Comparison c, const triple<V>& a, const triple<V>& b) {
  return {c ? a.x : b.x, c ? a.y : b.y, c ? a.z : b.z};
}

/// Lane i of a comparison as bit i.
template <class Comparison>
CILANTRO_ALWAYS_INLINE unsigned bits(Comparison c) {
  return __builtin_bit_cast(std::uint16_t, convert<vec<bool, width>>(c));
}

template <class T>
CILANTRO_ALWAYS_INLINE T largest_lane(vec<T, width> v) {
  const auto eight = larger(v.lo, v.hi);
  const auto four = larger(eight.lo, eight.hi);
  const auto two = larger(four.lo, four.hi);
  return two.x > two.y ? two.x : two.y;
}

}  // namespace
}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET
