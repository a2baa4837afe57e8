// SPDX-License-Identifier: MIT
#include "registration/kernels/pair_equations.hpp"

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

/// Eight pairs. y: the moved source point from the centre; n: the normal, zero if unknown; e: from
/// the target to the source point.
struct eight_pairs {
  numbers y[3], n[3], e[3], is_pair;

  [[nodiscard]] CILANTRO_ALWAYS_INLINE numbers squared_distance() const {
    return e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
  }
  [[nodiscard]] CILANTRO_ALWAYS_INLINE numbers along_normal() const {
    return e[0] * n[0] + e[1] * n[1] + e[2] * n[2];
  }
  [[nodiscard]] CILANTRO_ALWAYS_INLINE auto count(numbers square) const {
    return (is_pair > 0) & (square < __builtin_inf());
  }
};

struct totals {
  numbers pairs = 0, squared_distance = 0;

  CILANTRO_ALWAYS_INLINE void add(const eight_pairs& p) {
    const numbers square = p.squared_distance(), one = 1, zero = 0;
    const auto counts = p.count(square);
    pairs += counts ? one : zero;
    squared_distance += counts ? square : zero;
  }
};

struct plane_sums {
  numbers information[21] = {}, gradient[6] = {}, place[3] = {}, spread[6] = {};
  numbers weight = 0, squared_residual = 0;

  template <bool Weighted>
  CILANTRO_ALWAYS_INLINE void add(const eight_pairs& p, numbers given) {
    const auto& [y, n, e, is_pair] = p;
    const numbers value = p.along_normal(), one = 1, zero = 0;
    auto says = p.count(p.squared_distance()) & ((n[0] != 0) | (n[1] != 0) | (n[2] != 0)) &
                (value - value == 0);
    if constexpr (Weighted) says = says & (given > 0);
    const numbers w = says ? (Weighted ? given : one) : zero;
    const numbers r = says ? value : zero;
    weight += w;
    const numbers row[6] = {says ? y[1] * n[2] - y[2] * n[1] : zero,
                            says ? y[2] * n[0] - y[0] * n[2] : zero,
                            says ? y[0] * n[1] - y[1] * n[0] : zero,
                            says ? n[0] : zero,
                            says ? n[1] : zero,
                            says ? n[2] : zero};
    const auto weighted = [&](numbers v) {
      if constexpr (Weighted) return w * v;
      return v;
    };
    squared_residual += weighted(r) * r;
    int next = 0;
    for (int a = 0; a < 6; ++a) {
      const numbers factor = weighted(row[a]);
      gradient[a] += factor * r;
      for (int b = a; b < 6; ++b) information[next++] += factor * row[b];
    }
    next = 0;
    for (int a = 0; a < 3; ++a) {
      const numbers from = says ? weighted(y[a]) : zero;
      place[a] += from;
      for (int b = a; b < 3; ++b) spread[next++] += says ? from * y[b] : zero;
    }
  }
  CILANTRO_ALWAYS_INLINE void write(pair_sums::plane_term& out) const {
    for (int i = 0; i < 21; ++i) out.information[i] = sum_of(information[i]);
    for (int i = 0; i < 6; ++i) out.gradient[i] = sum_of(gradient[i]);
    for (int i = 0; i < 3; ++i) out.place[i] = sum_of(place[i]);
    for (int i = 0; i < 6; ++i) out.spread[i] = sum_of(spread[i]);
    out.weight = sum_of(weight);
    out.squared_residual = sum_of(squared_residual);
  }
};

struct point_sums {
  numbers difference[3] = {}, moment[3] = {}, place[3] = {}, spread[6] = {};
  numbers weight = 0, squared_residual = 0;

  CILANTRO_ALWAYS_INLINE void add(const eight_pairs& p, numbers given) {
    const numbers square = p.squared_distance(), zero = 0;
    const auto says = p.count(square) & (given > 0);
    const numbers w = says ? given : zero;
    numbers y[3], e[3];
    for (int d = 0; d < 3; ++d) {
      y[d] = says ? p.y[d] : zero;
      e[d] = w * (says ? p.e[d] : zero);
      difference[d] += e[d];
    }
    weight += w;
    squared_residual += w * (says ? square : zero);
    moment[0] += y[1] * e[2] - y[2] * e[1];
    moment[1] += y[2] * e[0] - y[0] * e[2];
    moment[2] += y[0] * e[1] - y[1] * e[0];
    int next = 0;
    for (int a = 0; a < 3; ++a) {
      const numbers from = w * y[a];
      place[a] += from;
      for (int b = a; b < 3; ++b) spread[next++] += from * y[b];
    }
  }
  CILANTRO_ALWAYS_INLINE void write(pair_sums::point_term& out) const {
    for (int i = 0; i < 3; ++i) out.difference[i] = sum_of(difference[i]);
    for (int i = 0; i < 3; ++i) out.moment[i] = sum_of(moment[i]);
    for (int i = 0; i < 3; ++i) out.place[i] = sum_of(place[i]);
    for (int i = 0; i < 6; ++i) out.spread[i] = sum_of(spread[i]);
    out.weight = sum_of(weight);
    out.squared_residual = sum_of(squared_residual);
  }
};

template <class S, bool Plane, bool Point, bool Weighted>
void sum_up(const matched_points<S>& all, const pair_weights& weights, pair_sums& out) {
  totals total;
  plane_sums plane;
  point_sums point;
  gathered<S> source, target, normals;
  eight_pairs some[batch / at_once];
  alignas(64) double along[batch], squares[batch], plane_weights[batch], point_weights[batch];
  const char* pair = static_cast<const char*>(all.pairs);
  for (std::ptrdiff_t begin = 0; begin < all.count; begin += batch) {
    const int size = static_cast<int>(smaller<std::ptrdiff_t>(batch, all.count - begin));
    for (int i = 0; i < batch; ++i) {
      // Behind the last pair comes the last one again, without a weight.
      std::int32_t indices[2];
      __builtin_memcpy(indices, pair, sizeof indices);
      if (i + 1 < size) pair += all.pair_size;
      source.put(i, all.source, indices[0]);
      target.put(i, all.target, indices[1]);
      if constexpr (Plane) normals.put(i, all.normals, indices[1]);
    }
    pair += all.pair_size;
    for (int i = 0; i < size; i += at_once) {
      eight_pairs& p = some[i / at_once];
      for (int k = 0; k < at_once; ++k) p.is_pair[k] = i + k < size;
      for (int r = 0; r < 3; ++r) {
        const numbers moved = source.get(0, i) * all.linear[r] +
                              source.get(1, i) * all.linear[3 + r] +
                              source.get(2, i) * all.linear[6 + r] + all.translation[r];
        p.y[r] = moved - all.center[r];
        p.e[r] = moved - target.get(r, i);
        p.n[r] = Plane ? normals.get(r, i) : numbers(0);
      }
      if constexpr (Weighted) {
        store(along + i, p.along_normal());
        store(squares + i, p.squared_distance());
      } else {
        total.add(p);
        plane.add<false>(p, 1);
      }
    }
    if constexpr (Weighted) {
      weights.weigh(weights.context, begin, size, along, squares, plane_weights, point_weights);
      // Behind the last pair there are no weights.
      for (int i = size; i % at_once != 0; ++i) plane_weights[i] = point_weights[i] = 0;
      for (int i = 0; i < size; i += at_once) {
        const eight_pairs& p = some[i / at_once];
        total.add(p);
        if constexpr (Plane) plane.add<true>(p, load<numbers>(plane_weights + i));
        if constexpr (Point) point.add(p, load<numbers>(point_weights + i));
      }
    }
  }
  out.pairs = sum_of(total.pairs);
  out.squared_distance = sum_of(total.squared_distance);
  plane.write(out.plane);
  point.write(out.point);
}

}  // namespace
}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET

namespace cilantro::detail {

using namespace CILANTRO_VECTOR_TARGET;

template <kernel_target V, class S>
pair_equations<S> pair_equations_in() {
  return {sum_up<S, true, false, false>, sum_up<S, true, false, true>, sum_up<S, false, true, true>,
          sum_up<S, true, true, true>};
}
template pair_equations<float> pair_equations_in<this_target, float>();
template pair_equations<double> pair_equations_in<this_target, double>();

}  // namespace cilantro::detail
