// SPDX-License-Identifier: MIT
#include "geometry/kernels/group_means.hpp"

#include "core/vectors.hpp"

namespace cilantro::detail::CILANTRO_VECTOR_TARGET {
namespace {

/// The coordinates of a point are the lanes; those that are left over hold anything.
template <class S, int D>
std::ptrdiff_t find_means(const grouped_points<S>& groups, std::ptrdiff_t first,
                          std::ptrdiff_t count, S* means) {
  constexpr int lanes = D == 2 ? 2 : 4;
  using point = vec<S, lanes>;
  using sums = vec<double, lanes>;
  // Members of a cell are apart in memory, where no processor foresees them.
  constexpr std::ptrdiff_t ahead = 24;
  const std::ptrdiff_t last = groups.offsets[first + count] - 1;
  for (std::ptrdiff_t g = 0; g < count; ++g) {
    const std::ptrdiff_t begin = groups.offsets[first + g], end = groups.offsets[first + g + 1];
    sums sum = 0;
    for (std::ptrdiff_t m = begin; m < end; ++m) {
      __builtin_prefetch(groups.points + groups.members[smaller(m + ahead, last)] * groups.stride);
      const std::ptrdiff_t i = groups.members[m];
      const S* const from = groups.points + i * groups.stride;
      point value = S(0);
      // Behind the last point there may be no memory.
      if (D == lanes || i + 1 < groups.count)
        value = load<point>(from);
      else
        __builtin_memcpy(&value, from, D * sizeof *from);
      sum += convert<sums>(value);
    }
    const sums mean = sum / static_cast<double>(end - begin);
    for (int d = 0; d < D; ++d) {
      if (!(mean[d] - mean[d] == 0)) return g;
      means[g * D + d] = static_cast<S>(mean[d]);
    }
  }
  return count;
}

}  // namespace
}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET

namespace cilantro::detail {

using namespace CILANTRO_VECTOR_TARGET;

template <kernel_target V, class S, int D>
group_means<S>* group_means_in() {
  return find_means<S, D>;
}
template group_means<float>* group_means_in<this_target, float, 2>();
template group_means<float>* group_means_in<this_target, float, 3>();
template group_means<double>* group_means_in<this_target, double, 2>();
template group_means<double>* group_means_in<this_target, double, 3>();

}  // namespace cilantro::detail
