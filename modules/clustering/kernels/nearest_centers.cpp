// SPDX-License-Identifier: MIT
#include "clustering/kernels/nearest_centers.hpp"

#include "core/vectors.hpp"

namespace cilantro::detail::CILANTRO_VECTOR_TARGET {
namespace {

template <class S, int D>
struct point_group {
  vec<S, width> places[D];

  /// Fewer are filled up with the first.
  CILANTRO_ALWAYS_INLINE point_group(const S* points, std::ptrdiff_t stride,
                                     const std::int32_t* indices, std::ptrdiff_t size) {
    if constexpr (D == 3) {
      if (stride == 3 && size == width && indices[width - 1] - indices[0] == width - 1) {
        load_by_axis(points + indices[0] * std::ptrdiff_t{3}, places);
        return;
      }
    }
    alignas(64) S room[D][width];
    for (std::ptrdiff_t i = 0; i < width; ++i) {
      const S* point = points + indices[i < size ? i : 0] * stride;
      for (int d = 0; d < D; ++d) room[d][i] = point[d];
    }
    for (int d = 0; d < D; ++d) places[d] = load<vec<S, width>>(room[d]);
  }
};

/// The two least of many lanes, of which each has its own two.
template <class V>
CILANTRO_ALWAYS_INLINE auto second_least(V first, V second) {
  if constexpr (sizeof first == 2 * sizeof first[0]) {
    return smaller(larger(first.x, first.y), smaller(second.x, second.y));
  } else {
    return second_least(smaller(first.lo, first.hi),
                        smaller(larger(first.lo, first.hi), smaller(second.lo, second.hi)));
  }
}

/// Writes the centres that may be one of the two nearest to a point of the group; how many they
/// are.
///
/// By the box around the group: at least two centres are within the second least of all bounds from
/// above, so that one beyond it by its bound from below is not among the two nearest. Exact, since
/// rounding keeps the order of what a sum is made of.
template <class S, int D>
CILANTRO_ALWAYS_INLINE int centers_near(const point_group<S, D>& group,
                                        const center_rows<S>& centers, std::int32_t* out) {
  using all = vec<S, width>;
  S low[D], high[D];
  for (int d = 0; d < D; ++d) {
    low[d] = -largest_lane(-group.places[d]);
    high[d] = largest_lane(group.places[d]);
  }
  constexpr S infinity = S(__builtin_inf());
  alignas(64) S below[most_centers];
  all first = infinity, second = infinity;
  for (std::ptrdiff_t c = 0; c < centers.count; c += width) {
    all least = 0, most = 0;
    for (int d = 0; d < D; ++d) {
      const all center = load<all>(centers.rows + d * centers.row_stride + c);
      const all over = low[d] - center, under = center - high[d];
      const all out_of = larger(larger(over, under), all(0));
      const all across = larger(-over, -under);
      least = d == 0 ? out_of * out_of : least + out_of * out_of;
      most = d == 0 ? across * across : most + across * across;
    }
    store(below + c, least);
    second = smaller(second, larger(first, most));
    first = smaller(first, most);
  }
  const S limit = second_least(first, second);
  int found = 0;
  for (std::ptrdiff_t c = 0; c < centers.count; c += width) {
    auto rest = bits(load<all>(below + c) <= limit);
    if (centers.count - c < width) rest &= (1u << (centers.count - c)) - 1;
    for (; rest; rest &= rest - 1)
      out[found++] = static_cast<std::int32_t>(c + __builtin_ctz(rest));
  }
  return found;
}

/// Points are the lanes, and each centre is compared with all of them: the best two are kept by
/// comparisons and selections alone.
template <class S, int D>
void find_nearest(const S* points, std::ptrdiff_t stride, const std::int32_t* indices,
                  std::ptrdiff_t count, const center_rows<S>& centers, std::int32_t* nearest,
                  S* first, S* second) {
  using all = vec<S, width>;
  using integers = vec<std::int32_t, width>;
  for (std::ptrdiff_t begin = 0; begin < count; begin += width) {
    const auto size = smaller<std::ptrdiff_t>(width, count - begin);
    const point_group<S, D> group{points, stride, indices + begin, size};
    std::int32_t near[most_centers];
    const int near_count = centers_near<S, D>(group, centers, near);
    all best = S(__builtin_inf()), next = best;
    integers which = 0;
    for (int k = 0; k < near_count; ++k) {
      all sum;
      for (int d = 0; d < D; ++d) {
        const all difference = group.places[d] - centers.rows[d * centers.row_stride + near[k]];
        sum = d == 0 ? difference * difference : sum + difference * difference;
      }
      const auto is_best = sum < best;
      next = smaller(next, larger(sum, best));
      best = smaller(sum, best);
      which = convert<integers>(is_best) ? integers(near[k]) : which;
    }
    best = __builtin_elementwise_sqrt(best);
    next = __builtin_elementwise_sqrt(next);
    for (std::ptrdiff_t i = 0; i < size; ++i) {
      nearest[begin + i] = which[i];
      first[begin + i] = best[i];
      second[begin + i] = next[i];
    }
  }
}

/// Neighbours in memory are often of one centre.
template <class S>
CILANTRO_ALWAYS_INLINE vec<S, width> of_each(const S* from, const std::int32_t* at, bool is_one) {
  vec<S, width> values = from[at[0]];
  if (!is_one)
    for (int i = 1; i < width; ++i) values[i] = from[at[i]];
  return values;
}

/// Sixteen at a time; the distance to their own centres is looked at only if one of them needs it.
template <class S, int D>
std::ptrdiff_t find_doubtful(const S* points, std::ptrdiff_t stride, const std::int32_t* indices,
                             std::ptrdiff_t count, const center_rows<S>& centers,
                             const moved_centers<S>& known, const std::int32_t* own, S* upper,
                             S* lower, std::int32_t* doubtful) {
  using all = vec<S, width>;
  using integers = vec<std::int32_t, width>;
  const S more = 1 + known.slack, less = 1 - known.slack;
  std::ptrdiff_t found = 0;
  for (std::ptrdiff_t begin = 0; begin < count; begin += width) {
    const auto size = smaller<std::ptrdiff_t>(width, count - begin);
    alignas(64) std::int32_t labels[width];
    alignas(64) S bounds[2][width] = {};
    for (std::ptrdiff_t i = 0; i < width; ++i) labels[i] = own[begin + (i < size ? i : 0)];
    __builtin_memcpy(bounds[0], upper + begin, std::size_t(size) * sizeof *upper);
    __builtin_memcpy(bounds[1], lower + begin, std::size_t(size) * sizeof *lower);
    const bool is_one = bits(load<integers>(labels) != labels[0]) == 0;
    all above = load<all>(bounds[0]) + of_each(known.moves, labels, is_one);
    const all below = load<all>(bounds[1]) - known.farthest;
    const all limit = larger(of_each(known.halves, labels, is_one), below) * less;
    unsigned rest = ((1u << size) - 1) & ~bits(above * more < limit);
    if (rest) {
      const point_group<S, D> group{points, stride, indices + begin, size};
      all sum;
      for (int d = 0; d < D; ++d) {
        const S* row = centers.rows + d * centers.row_stride;
        const all difference = group.places[d] - of_each(row, labels, is_one);
        sum = d == 0 ? difference * difference : sum + difference * difference;
      }
      const all exact = __builtin_elementwise_sqrt(sum);
      above = above * more < limit ? above : exact;
      rest &= ~bits(exact * more < limit);
    }
    store(bounds[0], above);
    store(bounds[1], below);
    __builtin_memcpy(upper + begin, bounds[0], std::size_t(size) * sizeof *upper);
    __builtin_memcpy(lower + begin, bounds[1], std::size_t(size) * sizeof *lower);
    for (; rest; rest &= rest - 1)
      doubtful[found++] = static_cast<std::int32_t>(begin + __builtin_ctz(rest));
  }
  return found;
}

}  // namespace
}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET

namespace cilantro::detail {

using namespace CILANTRO_VECTOR_TARGET;

template <kernel_target V, class S, int D>
nearest_centers<S>* nearest_centers_in() {
  return find_nearest<S, D>;
}
template <kernel_target V, class S, int D>
doubtful_points<S>* doubtful_points_in() {
  return find_doubtful<S, D>;
}
template nearest_centers<float>* nearest_centers_in<this_target, float, 2>();
template nearest_centers<float>* nearest_centers_in<this_target, float, 3>();
template nearest_centers<double>* nearest_centers_in<this_target, double, 2>();
template nearest_centers<double>* nearest_centers_in<this_target, double, 3>();
template doubtful_points<float>* doubtful_points_in<this_target, float, 2>();
template doubtful_points<float>* doubtful_points_in<this_target, float, 3>();
template doubtful_points<double>* doubtful_points_in<this_target, double, 2>();
template doubtful_points<double>* doubtful_points_in<this_target, double, 3>();

}  // namespace cilantro::detail
