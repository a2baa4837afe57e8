// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
module cilantro.geometry;

namespace cilantro {
namespace {

/// Groups handed to a thread at a time.
constexpr index_t picked_block_size = 512;

/// The member of each group with the least of what `rank_of_group(members)` returns a function for.
template <class F>
index_list least_of_groups(index_t size, const point_groups& groups, const execution& how,
                           F rank_of_group) {
  expects(std::ranges::all_of(groups.members, [&](std::int32_t i) { return 0 <= i && i < size; }),
          "groups: a member is not one of the points");
  index_list picked(groups.size());
  parallel_blocks(groups.size(), picked_block_size, how, [&](index_t, index_t begin, index_t end) {
    for (index_t g = begin; g < end; ++g) {
      const auto members = groups[g];
      expects(!members.empty(), "groups: a group has no member to pick");
      auto rank = rank_of_group(members);
      double least = std::numeric_limits<double>::infinity();
      std::int32_t best = members.front();
      for (const auto i : members)
        if (const double r = rank(i); r < least) {
          least = r;
          best = i;
        }
      picked[g] = best;
    }
  });
  return picked;
}

}  // namespace

index_list first_of_groups(const point_groups& groups) {
  index_list first;
  for (index_t g = 0; g < groups.size(); ++g) {
    expects(!groups[g].empty(), "groups: a group has no member to pick");
    first.push_back(groups[g].front());
  }
  return first;
}

template <Scalar S, int D>
index_list closed_nearest_to_centers(points_view<S, D> points, const point_groups& groups,
                                     const cell_layout<D>& layout, const execution& how) {
  return least_of_groups(points.size(), groups, how, [&](std::span<const std::int32_t> members) {
    const point_vector<double, D> cell =
        voxel_of<S, D>(points[members.front()], layout).template cast<double>();
    const point_vector<double, D> center =
        layout.origin + layout.edges.cwiseProduct(cell) + layout.edges / 2;
    return [&points, center](std::int32_t i) {
      return (points[i].template cast<double>() - center).squaredNorm();
    };
  });
}

template <Scalar S, int D>
index_list closed_medoids(points_view<S, D> normals, const point_groups& groups,
                          const execution& how) {
  // Σⱼ sin²(i, j) = m − nᵢᵀ (Σⱼ nⱼ nⱼᵀ) nᵢ: all pairs of a cell at the cost of one pass.
  using matrix = Eigen::Matrix<double, D, D>;
  const auto is_known = [&](std::int32_t i) {
    return is_finite(normals[i]) && !normals[i].isZero(0);
  };
  return least_of_groups(normals.size(), groups, how, [&](std::span<const std::int32_t> members) {
    matrix sum = matrix::Zero(normals.dimension(), normals.dimension());
    for (const auto i : members) {
      if (!is_known(i)) continue;
      const point_vector<double, D> n = normals[i].template cast<double>();
      sum.noalias() += n * n.transpose();
    }
    return [&normals, is_known, sum](std::int32_t i) {
      if (!is_known(i)) return std::numeric_limits<double>::infinity();
      const point_vector<double, D> n = normals[i].template cast<double>();
      return -n.dot(sum * n);
    };
  });
}

#define CILANTRO_INSTANTIATE(S, D)                                                              \
  template index_list closed_nearest_to_centers<S, D>(points_view<S, D>, const point_groups&,   \
                                                      const cell_layout<D>&, const execution&); \
  template index_list closed_medoids<S, D>(points_view<S, D>, const point_groups&,              \
                                           const execution&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
