// SPDX-License-Identifier: MIT
module;
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
void move_to_front(mutable_points_view<S, D> columns, std::span<const std::int32_t> indices) {
  for (index_t k = 0; k < std::ssize(indices); ++k)
    if (indices[k] != k) columns[k] = columns[indices[k]];
}

void keep_in_place(attribute& all, std::span<const std::int32_t> indices) {
  std::visit(
      [&](auto& values) {
        for (index_t k = 0; k < std::ssize(indices); ++k) values[k] = values[indices[k]];
        values.resize(indices.size());
      },
      all.values);
}

template <Scalar S, int D>
void choose_finite(points_view<S, D> points, chosen_points& kept) {
  kept.keep_if([&](index_t, std::int32_t i) { return is_finite(points[i]); });
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

#define CILANTRO_INSTANTIATE(S, D)                                                             \
  template point_matrix<S, D> gather_columns<S, D>(points_view<S, D>,                          \
                                                   std::span<const std::int32_t>);             \
  template void move_to_front<S, D>(mutable_points_view<S, D>, std::span<const std::int32_t>); \
  template void choose_finite<S, D>(points_view<S, D>, chosen_points&);                        \
  template void choose_finite<S, D>(const point_cloud<S, D>&, chosen_points&);                 \
  template point_cloud<S, D> gather(const point_cloud<S, D>&, std::span<const std::int32_t>);  \
  template point_cloud<S, D> gather(point_cloud<S, D>&&, std::span<const std::int32_t>);       \
  template point_cloud<S, D> gather(const point_cloud<S, D>&, const chosen_points&);           \
  template point_cloud<S, D> gather(point_cloud<S, D>&&, const chosen_points&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
