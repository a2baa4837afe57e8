// SPDX-License-Identifier: MIT
#include "consensus/kernels/plane_scores.hpp"

#include "core/vectors.hpp"

namespace cilantro::detail::CILANTRO_VECTOR_TARGET {
namespace {

template <class S, int D, bool ByResidual>
void score(const S* rows, std::ptrdiff_t row_stride, const std::uint8_t* active,
           std::ptrdiff_t count, const S* planes, S limit, S scale, double* counts,
           double* values) {
  using all = vec<S, width>;
  using mask = decltype(all{} < all{});
  mask counted[planes_at_a_time] = {};
  all sums[planes_at_a_time] = {};
  const auto add = [&](const all* x, mask is_active) {
    for (int p = 0; p < planes_at_a_time; ++p) {
      const S* plane = planes + p * (D + 1);
      all residual = plane[D] + plane[0] * x[0];
      for (int d = 1; d < D; ++d) residual += plane[d] * x[d];
      const mask agrees = (__builtin_elementwise_abs(residual) <= limit) & is_active;
      counted[p] -= agrees;
      if constexpr (ByResidual) sums[p] += agrees ? S(1) - residual * residual * scale : S(0);
    }
  };
  const auto active_at = [&](std::ptrdiff_t i) {
    return active ? convert<mask>(load<vec<std::uint8_t, width>>(active + i)) != 0 : mask(-1);
  };
  std::ptrdiff_t i = 0;
  for (; i + width <= count; i += width) {
    all x[D];
    for (int d = 0; d < D; ++d) x[d] = load<all>(rows + d * row_stride + i);
    add(x, active_at(i));
  }
  if (i < count) {
    all x[D];
    mask is_active = 0;
    for (int d = 0; d < D; ++d) x[d] = 0;
    for (int k = 0; k < count - i; ++k) {
      for (int d = 0; d < D; ++d) x[d][k] = rows[d * row_stride + i + k];
      is_active[k] = !active || active[i + k] ? -1 : 0;
    }
    add(x, is_active);
  }
  for (int p = 0; p < planes_at_a_time; ++p) {
    counts[p] = values[p] = 0;
    for (int k = 0; k < width; ++k) {
      counts[p] += static_cast<double>(counted[p][k]);
      values[p] += static_cast<double>(sums[p][k]);
    }
    if constexpr (!ByResidual) values[p] = counts[p];
  }
}

template <class S, int D>
void choose(const S* rows, std::ptrdiff_t row_stride, const std::uint8_t* active,
            std::ptrdiff_t count, const S* planes, S limit, S scale, double* counts,
            double* values) {
  (scale > 0 ? score<S, D, true> : score<S, D, false>)(rows, row_stride, active, count, planes,
                                                       limit, scale, counts, values);
}

}  // namespace
}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET

namespace cilantro::detail {

using namespace CILANTRO_VECTOR_TARGET;

template <kernel_target V, class S, int D>
plane_scores<S>* plane_scores_in() {
  return choose<S, D>;
}
template plane_scores<float>* plane_scores_in<this_target, float, 2>();
template plane_scores<float>* plane_scores_in<this_target, float, 3>();
template plane_scores<double>* plane_scores_in<this_target, double, 2>();
template plane_scores<double>* plane_scores_in<this_target, double, 3>();

}  // namespace cilantro::detail
