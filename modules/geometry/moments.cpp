// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
module cilantro.geometry;

namespace cilantro {
namespace {

/// Sums of differences from an origin, which is one of the points.
template <int D>
struct first_moment {
  index_t count = 0;
  point_vector<double, D> sum;
  first_moment& operator+=(const first_moment& other) {
    count += other.count;
    sum += other.sum;
    return *this;
  }
};

/// `at(i)` is point i out of n. `sum(zero, f)` adds `f(total, i)` over all i.
template <Scalar S, int D, class At, class Sum>
std::optional<moments<S, D>> two_passes(index_t n, index_t dimension, At at, Sum sum) {
  index_t first = 0;
  while (first < n && !is_finite(at(first))) ++first;
  if (first == n) return std::nullopt;

  using vector = point_vector<double, D>;
  using matrix = Eigen::Matrix<double, D, D>;
  const vector origin = at(first).template cast<double>();
  const auto total =
      sum(first_moment<D>{0, vector::Zero(dimension)}, [&](first_moment<D>& m, index_t i) {
        if (!is_finite(at(i))) return;
        ++m.count;
        m.sum += at(i).template cast<double>() - origin;
      });
  const vector mean = total.sum / double(total.count);
  matrix scatter = sum(matrix(matrix::Zero(dimension, dimension)), [&](matrix& m, index_t i) {
    if (!is_finite(at(i))) return;
    const vector difference = at(i).template cast<double>() - origin - mean;
    m += difference * difference.transpose();
  });
  if (total.count > 1) scatter /= double(total.count - 1);
  return moments<S, D>{total.count, (origin + mean).template cast<S>(), scatter};
}

}  // namespace

template <Scalar S, int D>
std::optional<moments<S, D>> closed_moments(points_view<S, D> points, const execution& how) {
  return two_passes<S, D>(
      points.size(), points.dimension(), [&](index_t i) { return points[i]; },
      [&]<class T>(const T& zero, auto add) { return ordered_sum(points.size(), how, zero, add); });
}

template <Scalar S, int D>
std::optional<moments<S, D>> closed_moments(points_view<S, D> points,
                                            std::span<const std::int32_t> indices) {
  return two_passes<S, D>(
      std::ssize(indices), points.dimension(), [&](index_t i) { return points[indices[i]]; },
      [&]<class T>(T total, auto add) {
        for (index_t i = 0; i < std::ssize(indices); ++i) add(total, i);
        return total;
      });
}

#define CILANTRO_INSTANTIATE(S, D)                                                                 \
  template std::optional<moments<S, D>> closed_moments<S, D>(points_view<S, D>, const execution&); \
  template std::optional<moments<S, D>> closed_moments<S, D>(points_view<S, D>,                    \
                                                             std::span<const std::int32_t>);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
