// SPDX-License-Identifier: MIT
#include "clustering/nearest_centers.hpp"

#include "core/vectors.hpp"

namespace cilantro::detail::CILANTRO_VECTOR_TARGET {
namespace {

/// Points are the lanes, and each centre is compared with all of them: the best two are kept by
/// comparisons and selections alone.
template <class S, int D>
void find_nearest(const S* points, std::ptrdiff_t stride, const std::int32_t* indices,
                  std::ptrdiff_t count, const S* centers, std::ptrdiff_t center_count,
                  std::int32_t* nearest, S* first, S* second) {
  using all = vec<S, width>;
  using integers = vec<std::int32_t, width>;
  for (std::ptrdiff_t begin = 0; begin < count; begin += width) {
    const auto size = smaller<std::ptrdiff_t>(width, count - begin);
    alignas(64) S places[D][width] = {};
    for (std::ptrdiff_t i = 0; i < size; ++i)
      for (int d = 0; d < D; ++d) places[d][i] = points[indices[begin + i] * stride + d];
    all best = S(__builtin_inf()), next = best;
    integers which = 0;
    for (std::ptrdiff_t c = 0; c < center_count; ++c) {
      all sum;
      for (int d = 0; d < D; ++d) {
        const all difference = load<all>(places[d]) - centers[c * D + d];
        sum = d == 0 ? difference * difference : sum + difference * difference;
      }
      const auto is_best = sum < best;
      next = smaller(next, larger(sum, best));
      best = smaller(sum, best);
      which = convert<integers>(is_best) ? integers(static_cast<std::int32_t>(c)) : which;
    }
    for (std::ptrdiff_t i = 0; i < size; ++i) {
      nearest[begin + i] = which[i];
      first[begin + i] = best[i];
      second[begin + i] = next[i];
    }
  }
}

}  // namespace

template <class S, int D>
nearest_centers<S>* nearest_centers_in() {
  return find_nearest<S, D>;
}
template nearest_centers<float>* nearest_centers_in<float, 2>();
template nearest_centers<float>* nearest_centers_in<float, 3>();
template nearest_centers<double>* nearest_centers_in<double, 2>();
template nearest_centers<double>* nearest_centers_in<double, 3>();

}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET
