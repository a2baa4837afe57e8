// SPDX-License-Identifier: MIT
#include "registration/plane_equations.hpp"

#include "core/vectors.hpp"

namespace cilantro::detail::CILANTRO_VECTOR_TARGET {
namespace {

// Pairs in a vector, on every target, so that all sum up in the same order.
constexpr int at_once = 8;
using numbers = vec<double, at_once>;

/// Pairs whose vectors are brought together at a time.
constexpr int batch = 64;

/// All x, all y and all z of some vectors.
template <class S>
struct gathered {
  alignas(64) S at[3][batch];

  CILANTRO_ALWAYS_INLINE void put(int i, const strided_vectors<S>& from, std::int32_t index) {
    const S* v = from.first + index * from.stride;
    for (int d = 0; d < 3; ++d) at[d][i] = v[d];
  }
  [[nodiscard]] CILANTRO_ALWAYS_INLINE numbers get(int d, int i) const {
    return convert<numbers>(load<vec<S, at_once>>(at[d] + i));
  }
};

CILANTRO_ALWAYS_INLINE double sum_of(numbers v) {
  const auto four = v.lo + v.hi;
  const auto two = four.lo + four.hi;
  return two.x + two.y;
}

struct sums {
  numbers information[21] = {}, gradient[6] = {}, place[3] = {}, spread[6] = {};
  numbers weight = 0, squared_residual = 0, squared_distance = 0, pairs = 0;

  /// y: the moved source point from the centre; n: the normal, zero if unknown; e: from the target
  /// to the source point.
  CILANTRO_ALWAYS_INLINE void add(const numbers (&y)[3], const numbers (&n)[3],
                                  const numbers (&e)[3], numbers is_pair) {
    const numbers square = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
    const numbers value = e[0] * n[0] + e[1] * n[1] + e[2] * n[2];
    const auto counts = (is_pair > 0) & (square < __builtin_inf());
    const auto says = counts & ((n[0] != 0) | (n[1] != 0) | (n[2] != 0)) & (value - value == 0);
    const numbers one = 1, zero = 0;
    pairs += counts ? one : zero;
    squared_distance += counts ? square : zero;
    weight += says ? one : zero;
    const numbers r = says ? value : zero;
    squared_residual += r * r;
    const numbers row[6] = {says ? y[1] * n[2] - y[2] * n[1] : zero,
                            says ? y[2] * n[0] - y[0] * n[2] : zero,
                            says ? y[0] * n[1] - y[1] * n[0] : zero,
                            says ? n[0] : zero,
                            says ? n[1] : zero,
                            says ? n[2] : zero};
    int next = 0;
    for (int a = 0; a < 6; ++a) {
      gradient[a] += row[a] * r;
      for (int b = a; b < 6; ++b) information[next++] += row[a] * row[b];
    }
    next = 0;
    for (int a = 0; a < 3; ++a) {
      const numbers from = says ? y[a] : zero;
      place[a] += from;
      for (int b = a; b < 3; ++b) spread[next++] += says ? from * y[b] : zero;
    }
  }
};

template <class S>
void sum_up(const plane_surfaces<S>& surfaces, const void* pairs, std::size_t pair_size,
            std::ptrdiff_t count, plane_sums& out) {
  sums total;
  gathered<S> source, target, normals;
  const char* pair = static_cast<const char*>(pairs);
  for (std::ptrdiff_t begin = 0; begin < count; begin += batch) {
    const int size = static_cast<int>(smaller<std::ptrdiff_t>(batch, count - begin));
    for (int i = 0; i < batch; ++i) {
      // Behind the last pair comes the last one again, without a weight.
      std::int32_t indices[2];
      __builtin_memcpy(indices, pair, sizeof indices);
      if (i + 1 < size) pair += pair_size;
      source.put(i, surfaces.source, indices[0]);
      target.put(i, surfaces.target, indices[1]);
      normals.put(i, surfaces.normals, indices[1]);
    }
    pair += pair_size;
    for (int i = 0; i < size; i += at_once) {
      numbers y[3], n[3], e[3], is_pair;
      for (int k = 0; k < at_once; ++k) is_pair[k] = i + k < size;
      for (int r = 0; r < 3; ++r) {
        const numbers moved = source.get(0, i) * surfaces.linear[r] +
                              source.get(1, i) * surfaces.linear[3 + r] +
                              source.get(2, i) * surfaces.linear[6 + r] + surfaces.translation[r];
        y[r] = moved - surfaces.center[r];
        e[r] = moved - target.get(r, i);
        n[r] = normals.get(r, i);
      }
      total.add(y, n, e, is_pair);
    }
  }
  for (int i = 0; i < 21; ++i) out.information[i] = sum_of(total.information[i]);
  for (int i = 0; i < 6; ++i) out.gradient[i] = sum_of(total.gradient[i]);
  for (int i = 0; i < 3; ++i) out.place[i] = sum_of(total.place[i]);
  for (int i = 0; i < 6; ++i) out.spread[i] = sum_of(total.spread[i]);
  out.weight = sum_of(total.weight);
  out.squared_residual = sum_of(total.squared_residual);
  out.squared_distance = sum_of(total.squared_distance);
  out.pairs = sum_of(total.pairs);
}

}  // namespace

template <class S>
plane_equations<S>* plane_equations_in() {
  return sum_up<S>;
}
template plane_equations<float>* plane_equations_in<float>();
template plane_equations<double>* plane_equations_in<double>();

}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET
