// SPDX-License-Identifier: MIT
//
// How the kernels of a search order what they find. Internal; see core/vectors.hpp.
#pragma once

#include "core/vectors.hpp"

namespace cilantro::detail::CILANTRO_VECTOR_TARGET {
namespace {

// Lanes of a sorted list in a register: all of AVX-512; two registers of the baseline.
#ifdef __AVX512F__
constexpr int list_lanes = 8;
#else
constexpr int list_lanes = 4;
#endif
template <class T>
using lanes = vec<T, list_lanes>;

/// `current` moved up by `By` lanes, after the last ones of `before`.
template <int By, class V>
CILANTRO_ALWAYS_INLINE V moved_up(V before, V current) {
#ifdef __AVX512F__
  if constexpr (By == 1)
    return __builtin_shufflevector(before, current, 7, 8, 9, 10, 11, 12, 13, 14);
  else
    return __builtin_shufflevector(before, current, 6, 7, 8, 9, 10, 11, 12, 13);
#else
  if constexpr (By == 1)
    return __builtin_shufflevector(before, current, 3, 4, 5, 6);
  else
    return __builtin_shufflevector(before, current, 2, 3, 4, 5);
#endif
}

constexpr std::int32_t no_index = 0x7fffffff;
constexpr double infinity = __builtin_inf();

/// Points that may be among the neighbours of one query, in the order of a block; the last one is
/// nobody, after all others.
template <class S>
struct candidates;

/// A float and an index as the bits of one double: a sum that is not negative, then the index. Such
/// doubles are finite, not negative, and ordered by the sum and then the index, so that lists of
/// them are kept by min and max alone, which every target has.
template <>
struct candidates<float> {
  using key = double;
  static constexpr std::uint64_t nobody = std::uint64_t{0x7f800000} << 32 | no_index;
  alignas(64) std::uint64_t keys[width + 1];

  CILANTRO_ALWAYS_INLINE candidates(vec<float, width> sums, vec<std::int32_t, width> indices) {
    using wide = vec<std::uint64_t, width>;
    using narrow = vec<std::uint32_t, width>;
    store(keys, convert<wide>(__builtin_bit_cast(narrow, sums)) << 32 |
                    convert<wide>(__builtin_bit_cast(narrow, indices)));
    keys[width] = nobody;
  }
  CILANTRO_ALWAYS_INLINE key operator[](int i) const { return __builtin_bit_cast(double, keys[i]); }
};

template <>
struct candidates<double> {
  struct key {
    double sum;
    std::int64_t index;
  };
  alignas(64) double sums[width + 1];
  alignas(64) std::int64_t indices[width + 1];

  CILANTRO_ALWAYS_INLINE candidates(vec<double, width> s, vec<std::int32_t, width> i) {
    store(sums, s);
    store(indices, convert<vec<std::int64_t, width>>(i));
    sums[width] = infinity;
    indices[width] = no_index;
  }
  CILANTRO_ALWAYS_INLINE key operator[](int i) const { return {sums[i], indices[i]}; }
};

/// The best of all that was added, ascending, in R registers; lanes before the first k are filled
/// with what nothing comes before, so that the k-th best is always the last lane.
template <class S, int R>
struct sorted_list;

template <int R>
struct sorted_list<float, R> {
  static constexpr int capacity = R * list_lanes;
  lanes<double> keys[R];

  sorted_list() = default;
  explicit sorted_list(int k) {
    double all[capacity];
    for (int i = 0; i < capacity; ++i)
      all[i] = i < capacity - k ? -infinity : __builtin_bit_cast(double, candidates<float>::nobody);
    __builtin_memcpy(keys, all, sizeof keys);
  }

  /// Two at a time, since each has to wait for the one before: of a sorted list s, lane i becomes
  /// min(s[i], max(s[i − 1], x), max(s[i − 2], y)) for x before y.
  CILANTRO_ALWAYS_INLINE void add(double a, double b) {
    const lanes<double> x = smaller(a, b), y = larger(a, b);
    for (int r = R - 1; r >= 0; --r) {
      const lanes<double> before = r > 0 ? keys[r - 1] : lanes<double>(-infinity);
      const auto one = larger(moved_up<1>(before, keys[r]), x);
      const auto two = larger(moved_up<2>(before, keys[r]), y);
      keys[r] = smaller(keys[r], smaller(one, two));
    }
  }
  [[nodiscard]] CILANTRO_ALWAYS_INLINE std::uint64_t last() const {
    return __builtin_bit_cast(vec<std::uint64_t, list_lanes>, keys[R - 1])[list_lanes - 1];
  }
  [[nodiscard]] CILANTRO_ALWAYS_INLINE float last_sum() const {
    return __builtin_bit_cast(float, static_cast<std::uint32_t>(last() >> 32));
  }
  [[nodiscard]] CILANTRO_ALWAYS_INLINE std::int32_t last_index() const {
    return static_cast<std::int32_t>(last());
  }
  CILANTRO_ALWAYS_INLINE void write(float* sums, std::int32_t* indices) const {
    for (int r = 0; r < R; ++r) {
      const auto all = __builtin_bit_cast(vec<std::uint64_t, list_lanes>, keys[r]);
      store(indices + r * list_lanes, convert<lanes<std::int32_t>>(all));
      store(sums + r * list_lanes,
            __builtin_bit_cast(lanes<float>, convert<lanes<std::uint32_t>>(all >> 32)));
    }
  }
};

template <int R>
struct sorted_list<double, R> {
  static constexpr int capacity = R * list_lanes;
  lanes<double> sums[R];
  lanes<std::int64_t> indices[R];

  sorted_list() = default;
  explicit sorted_list(int k) {
    double s[capacity];
    std::int64_t n[capacity];
    for (int i = 0; i < capacity; ++i) {
      s[i] = i < capacity - k ? -infinity : infinity;
      n[i] = i < capacity - k ? -1 : no_index;
    }
    __builtin_memcpy(sums, s, sizeof sums);
    __builtin_memcpy(indices, n, sizeof indices);
  }

  CILANTRO_ALWAYS_INLINE void add(candidates<double>::key a, candidates<double>::key b) {
    add(a);
    add(b);
  }
  CILANTRO_ALWAYS_INLINE void add(candidates<double>::key next) {
    const lanes<double> sum = next.sum;
    const lanes<std::int64_t> index = next.index;
    const auto comes_after = [&](lanes<double> s, lanes<std::int64_t> i) {
      return (s > sum) | ((s == sum) & (i > index));
    };
    for (int r = R - 1; r >= 0; --r) {
      const auto up = moved_up<1>(r > 0 ? sums[r - 1] : lanes<double>(-infinity), sums[r]);
      const auto up_index =
          moved_up<1>(r > 0 ? indices[r - 1] : lanes<std::int64_t>(-1), indices[r]);
      const auto here = comes_after(sums[r], indices[r]), there = comes_after(up, up_index);
      sums[r] = there ? up : here ? sum : sums[r];
      indices[r] = there ? up_index : here ? index : indices[r];
    }
  }
  [[nodiscard]] CILANTRO_ALWAYS_INLINE double last_sum() const {
    return sums[R - 1][list_lanes - 1];
  }
  [[nodiscard]] CILANTRO_ALWAYS_INLINE std::int32_t last_index() const {
    return static_cast<std::int32_t>(indices[R - 1][list_lanes - 1]);
  }
  CILANTRO_ALWAYS_INLINE void write(double* s, std::int32_t* i) const {
    for (int r = 0; r < R; ++r) {
      store(s + r * list_lanes, sums[r]);
      store(i + r * list_lanes, convert<lanes<std::int32_t>>(indices[r]));
    }
  }
};

}  // namespace
}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET
