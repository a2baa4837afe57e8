// SPDX-License-Identifier: MIT
module;
#include <cstddef>
#include <cstdint>
#include <span>
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
std::vector<std::int32_t> finite_columns(points_view<S, D> all) {
  std::vector<std::int32_t> finite;
  finite.reserve(all.size());
  for (index_t i = 0; i < all.size(); ++i)
    if (is_finite(all[i])) finite.push_back(static_cast<std::int32_t>(i));
  return finite;
}

#define CILANTRO_INSTANTIATE(S, D)                                                 \
  template point_matrix<S, D> gather_columns<S, D>(points_view<S, D>,              \
                                                   std::span<const std::int32_t>); \
  template std::vector<std::int32_t> finite_columns<S, D>(points_view<S, D>);      \
  template point_cloud<S, D> gather(const point_cloud<S, D>&, std::span<const std::int32_t>);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
