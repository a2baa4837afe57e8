// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "core/closed_spaces.hpp"
module cilantro.cloud;

namespace cilantro {

template <Scalar S, int D>
point_matrix<S, D> gather_columns(points_view<S, D> all, std::span<const std::int32_t> indices) {
  point_matrix<S, D> selected(all.dimension(), std::ssize(indices));
  for (index_t i = 0; i < selected.cols(); ++i) selected.col(i) = all[indices[i]];
  return selected;
}

template <Scalar S, int D>
point_cloud<S, D> gather(const point_cloud<S, D>& cloud, std::span<const std::int32_t> indices) {
  constexpr int C = closed_dimension<D>;
  point_cloud<S, D> selected;
  selected.points = gather_columns<S, C>(as_points(cloud.points), indices);
  if (cloud.has_normals())
    selected.normals = gather_columns<S, C>(as_points(cloud.normals), indices);
  if (cloud.has_colors())
    selected.colors = gather_columns<float, 3>(as_points(cloud.colors), indices);
  for (const auto& a : cloud.attributes) selected.attributes.push_back(select(a, indices));
  selected.comments = cloud.comments;
  selected.origin = cloud.origin;
  return selected;
}

namespace {

template <class M>
void compact_columns(M& columns, std::span<const std::int32_t> indices) {
  for (index_t k = 0; k < std::ssize(indices); ++k)
    if (indices[k] != k) columns.col(k) = columns.col(indices[k]);
  columns.conservativeResize(columns.rows(), std::ssize(indices));
}

void compact(attribute& all, std::span<const std::int32_t> indices) {
  std::visit(
      [&](auto& values) {
        for (index_t k = 0; k < std::ssize(indices); ++k) values[k] = values[indices[k]];
        values.resize(indices.size());
      },
      all.values);
}

}  // namespace

template <Scalar S, int D>
point_cloud<S, D> gather(point_cloud<S, D>&& cloud, std::span<const std::int32_t> indices) {
  // A little that is left should not hold on to the memory of all.
  const bool in_place = std::ssize(indices) >= cloud.size() / 2 &&
                        std::ranges::is_sorted(indices, std::ranges::less_equal{});
  if (!in_place) return gather(std::as_const(cloud), indices);
  compact_columns(cloud.points, indices);
  if (cloud.has_normals()) compact_columns(cloud.normals, indices);
  if (cloud.has_colors()) compact_columns(cloud.colors, indices);
  for (auto& a : cloud.attributes) compact(a, indices);
  cloud.width = cloud.height = 0;
  return std::move(cloud);
}

void keep_and_tell(std::span<const std::int32_t> left, removed_indices removed,
                   chosen_points& kept) {
  if (removed) {
    std::vector<bool> is_left(kept.size());
    for (const auto k : left) is_left[k] = true;
    removed->clear();
    for (index_t k = 0; k < kept.size(); ++k)
      if (!is_left[k]) removed->push_back(static_cast<std::int32_t>(k));
  }
  kept.keep(left);
}

#define CILANTRO_INSTANTIATE(S, D)                                                            \
  template point_matrix<S, D> gather_columns<S, D>(points_view<S, D>,                         \
                                                   std::span<const std::int32_t>);            \
  template point_cloud<S, D> gather(const point_cloud<S, D>&, std::span<const std::int32_t>); \
  template point_cloud<S, D> gather(point_cloud<S, D>&&, std::span<const std::int32_t>);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
