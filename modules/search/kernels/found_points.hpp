// SPDX-License-Identifier: MIT
//
// All points within a radius of one query, as a kernel gathers and sorts them. Internal; see
// core/vectors.hpp.
#pragma once

#include "search/kernels/candidates.hpp"

#ifdef __AVX512F__
#include <immintrin.h>
#endif

namespace cilantro::detail::CILANTRO_VECTOR_TARGET {
namespace {

/// The longest list that is sorted by counting, for each of its members, how many come before:
/// quadratic, but without a branch.
constexpr std::ptrdiff_t longest_run = 64;

/// Members in two arrays of `capacity` each, which need not be initialised; the second is where
/// sorting merges to.
template <class S>
class found_points;

template <>
class found_points<float> {
 public:
  found_points(void* room, std::ptrdiff_t capacity)
      : keys_{static_cast<double*>(room)}, spare_{keys_ + capacity} {}

  [[nodiscard]] std::ptrdiff_t size() const { return size_; }
  CILANTRO_ALWAYS_INLINE void add(const candidates<float>& all, unsigned which) {
#ifdef __AVX512F__
    // By a register: compressing into memory is slow on some machines. There is room for all.
    const auto low = static_cast<__mmask8>(which), high = static_cast<__mmask8>(which >> 8);
    _mm512_storeu_pd(keys_ + size_, _mm512_maskz_compress_pd(low, _mm512_load_pd(all.keys)));
    size_ += __builtin_popcount(low);
    _mm512_storeu_pd(keys_ + size_, _mm512_maskz_compress_pd(high, _mm512_load_pd(all.keys + 8)));
    size_ += __builtin_popcount(high);
#else
    for (; which != 0; which &= which - 1) keys_[size_++] = all[__builtin_ctz(which)];
#endif
  }
  void sort_run(std::ptrdiff_t begin, std::ptrdiff_t end, found_points& to) const {
    using ranks = lanes<std::int64_t>;
    for (std::ptrdiff_t i = begin; i < end; i += list_lanes) {
      const std::ptrdiff_t count = smaller<std::ptrdiff_t>(end - i, list_lanes);
      lanes<double> mine = infinity;
      __builtin_memcpy(&mine, keys_ + i, std::size_t(count) * sizeof(double));
      ranks rank = 0;
      for (std::ptrdiff_t j = begin; j < end; ++j) rank -= lanes<double>(keys_[j]) < mine;
      for (std::ptrdiff_t l = 0; l < count; ++l) to.keys_[begin + rank[l]] = keys_[i + l];
    }
  }
  [[nodiscard]] bool comes_before(std::ptrdiff_t i, std::ptrdiff_t j) const {
    return keys_[i] < keys_[j];
  }
  void copy(std::ptrdiff_t from, std::ptrdiff_t to, found_points& other) const {
    other.keys_[to] = keys_[from];
  }
  [[nodiscard]] found_points spare() const { return {spare_, keys_, size_}; }

  void write(std::int32_t* indices, float* distances) const {
    for (std::ptrdiff_t i = 0; i < size_; ++i) {
      const auto key = __builtin_bit_cast(std::uint64_t, keys_[i]);
      indices[i] = static_cast<std::int32_t>(key);
      distances[i] =
          __builtin_sqrtf(__builtin_bit_cast(float, static_cast<std::uint32_t>(key >> 32)));
    }
  }

 private:
  found_points(double* keys, double* spare, std::ptrdiff_t size)
      : keys_{keys}, spare_{spare}, size_{size} {}

  double *keys_, *spare_;
  std::ptrdiff_t size_ = 0;
};

template <>
class found_points<double> {
 public:
  found_points(void* room, std::ptrdiff_t capacity)
      : sums_{static_cast<double*>(room)},
        indices_{reinterpret_cast<std::int64_t*>(sums_ + capacity)},
        spare_sums_{sums_ + 2 * capacity},
        spare_indices_{reinterpret_cast<std::int64_t*>(sums_ + 3 * capacity)} {}

  [[nodiscard]] std::ptrdiff_t size() const { return size_; }
  CILANTRO_ALWAYS_INLINE void add(const candidates<double>& all, unsigned which) {
    for (; which != 0; which &= which - 1) {
      const auto key = all[__builtin_ctz(which)];
      sums_[size_] = key.sum;
      indices_[size_++] = key.index;
    }
  }
  void sort_run(std::ptrdiff_t begin, std::ptrdiff_t end, found_points& to) const {
    for (std::ptrdiff_t i = begin; i < end; i += list_lanes) {
      const std::ptrdiff_t count = smaller<std::ptrdiff_t>(end - i, list_lanes);
      lanes<double> sum = infinity;
      lanes<std::int64_t> index = no_index, rank = 0;
      __builtin_memcpy(&sum, sums_ + i, std::size_t(count) * sizeof(double));
      __builtin_memcpy(&index, indices_ + i, std::size_t(count) * sizeof(std::int64_t));
      for (std::ptrdiff_t j = begin; j < end; ++j) {
        const lanes<double> other = sums_[j];
        rank -= (other < sum) | ((other == sum) & (lanes<std::int64_t>(indices_[j]) < index));
      }
      for (std::ptrdiff_t l = 0; l < count; ++l) copy(i + l, begin + rank[l], to);
    }
  }
  [[nodiscard]] bool comes_before(std::ptrdiff_t i, std::ptrdiff_t j) const {
    return sums_[i] < sums_[j] || (sums_[i] == sums_[j] && indices_[i] < indices_[j]);
  }
  void copy(std::ptrdiff_t from, std::ptrdiff_t to, found_points& other) const {
    other.sums_[to] = sums_[from];
    other.indices_[to] = indices_[from];
  }
  [[nodiscard]] found_points spare() const {
    found_points other = *this;
    other.sums_ = spare_sums_;
    other.indices_ = spare_indices_;
    other.spare_sums_ = sums_;
    other.spare_indices_ = indices_;
    return other;
  }

  void write(std::int32_t* indices, double* distances) const {
    for (std::ptrdiff_t i = 0; i < size_; ++i) {
      indices[i] = static_cast<std::int32_t>(indices_[i]);
      distances[i] = __builtin_sqrt(sums_[i]);
    }
  }

 private:
  double* sums_;
  std::int64_t* indices_;
  double* spare_sums_;
  std::int64_t* spare_indices_;
  std::ptrdiff_t size_ = 0;
};

/// Ascending by sum, then index: runs by counting, then merged, as often as it takes.
template <class S>
[[nodiscard]] found_points<S> sorted(const found_points<S>& found) {
  const std::ptrdiff_t size = found.size();
  found_points<S> from = found.spare(), to = found;
  for (std::ptrdiff_t b = 0; b < size; b += longest_run)
    found.sort_run(b, smaller(b + longest_run, size), from);
  for (std::ptrdiff_t run = longest_run; run < size; run *= 2) {
    for (std::ptrdiff_t b = 0; b < size; b += 2 * run) {
      const std::ptrdiff_t middle = smaller(b + run, size), end = smaller(b + 2 * run, size);
      std::ptrdiff_t first = b, second = middle;
      for (std::ptrdiff_t next = b; next < end; ++next) {
        const bool take_second =
            first == middle || (second != end && from.comes_before(second, first));
        from.copy(take_second ? second++ : first++, next, to);
      }
    }
    const found_points<S> other = from;
    from = to;
    to = other;
  }
  return from;
}

}  // namespace
}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET
