// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
#include "geometry/kernels/group_means.hpp"
module cilantro.geometry;

namespace cilantro {
namespace {

void expect_members(const point_groups& groups, index_t size) {
  expects(std::ranges::all_of(groups.members, [&](std::int32_t i) { return 0 <= i && i < size; }),
          "groups: a member is not one of the points");
}

/// Groups handed to a thread at a time: few if they are large.
index_t block_size_of(const point_groups& groups) {
  constexpr index_t most = 512, members = 1 << 14;
  return std::clamp<index_t>(
      members * groups.size() / std::max<index_t>(1, std::ssize(groups.members)), 1, most);
}

template <Scalar S, int D>
detail::group_means<S>& means_kernel() {
  return *detail::for_target(
      static_cast<int>(current_vector_target()),
      []<detail::kernel_target V> { return detail::group_means_in<V, S, D>(); });
}

}  // namespace

template <Scalar S, int D>
point_matrix<S, D> closed_group_means(points_view<S, D> values, const point_groups& groups,
                                      const execution& how) {
  expect_members(groups, values.size());
  point_matrix<S, D> means(values.dimension(), groups.size());
  const auto mean_of_finite = [&](index_t g) {
    point_vector<double, D> sum = point_vector<double, D>::Zero(values.dimension());
    index_t count = 0;
    for (const auto i : groups[g]) {
      if (!is_finite(values[i])) continue;
      sum += values[i].template cast<double>();
      ++count;
    }
    means.col(g) = (sum / double(count)).template cast<S>();
  };
  parallel_blocks(groups.size(), block_size_of(groups), how,
                  [&](index_t, index_t begin, index_t end) {
                    for (index_t g = begin; g < end; ++g) {
                      if constexpr (D == 2 || D == 3) {
                        g += means_kernel<S, D>()({values.data(), values.stride(), values.size(),
                                                   groups.members.data(), groups.offsets.data()},
                                                  g, end - g, means.data() + g * D);
                        if (g == end) return;
                      }
                      mean_of_finite(g);
                    }
                  });
  return means;
}

template <Scalar S, int D>
point_matrix<S, D> closed_group_directions(points_view<S, D> directions, const point_groups& groups,
                                           const execution& how) {
  expect_members(groups, directions.size());
  point_matrix<S, D> means(directions.dimension(), groups.size());
  const auto mean_of = [&](index_t g) -> point_vector<double, D> {
    point_vector<double, D> sum = point_vector<double, D>::Zero(directions.dimension());
    index_t first = -1;
    for (const auto i : groups[g]) {
      const auto direction = directions[i];
      if (!is_finite(direction) || direction.isZero(0)) continue;
      if (first < 0) first = i;
      if (direction.dot(directions[first]) < 0)
        sum -= direction.template cast<double>();
      else
        sum += direction.template cast<double>();
    }
    const double length = sum.norm();
    // Unit vectors that cancel leave their rounding behind, which is no direction.
    if (length > 1e-6) return sum / length;
    return point_vector<double, D>::Zero(sum.size());
  };
  parallel_blocks(groups.size(), block_size_of(groups), how,
                  [&](index_t, index_t begin, index_t end) {
                    for (index_t g = begin; g < end; ++g)
                      means.col(g) = mean_of(g).template cast<S>();
                  });
  return means;
}

#define CILANTRO_INSTANTIATE(S, D)                                                             \
  template point_matrix<S, D> closed_group_means<S, D>(points_view<S, D>, const point_groups&, \
                                                       const execution&);                      \
  template point_matrix<S, D> closed_group_directions<S, D>(                                   \
      points_view<S, D>, const point_groups&, const execution&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
