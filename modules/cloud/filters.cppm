// SPDX-License-Identifier: MIT
//
// Fewer points of a cloud, with all that belongs to them.
module;
#include "core/closed_spaces.hpp"
export module cilantro.cloud:filters;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.geometry;
import :attribute;
import :point_cloud;

namespace cilantro {

template <Scalar S, int D>
point_matrix<S, D> gather_columns(points_view<S, D> all, std::span<const std::int32_t> indices);
template <Scalar S, int D>
std::vector<std::int32_t> finite_columns(points_view<S, D> all);

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

/// Which points of a cloud are meant: those with some indices, those of a mask, which has one truth
/// value per point (bool, or a byte such as in `dbscan_result::is_core`), or those whose index
/// satisfies a predicate.
export template <class W>
concept PointChoice = IndexRange<W> || MaskRange<W> || std::predicate<W, index_t>;

/// For each point whether it is chosen. Throws `invalid_input`, naming the function `who`, for an
/// index that is out of range, and for a mask of another size.
template <PointChoice W>
[[nodiscard]] std::vector<bool> mask_of(W&& which, index_t size, const char* who) {
  std::vector<bool> mask(size);
  if constexpr (std::predicate<W, index_t>) {
    for (index_t i = 0; i < size; ++i) mask[i] = which(i);
  } else if constexpr (MaskRange<W>) {
    index_t count = 0;
    for (const auto chosen : which) {
      if (count < size) mask[count] = static_cast<bool>(chosen);
      ++count;
    }
    expects(count == size, std::string{who} + ": the mask has " + std::to_string(count) +
                               " values, and the cloud has " + std::to_string(size) + " points");
  } else {
    for (const auto i : which) mask[checked_index(i, size, who)] = true;
  }
  return mask;
}

template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> gather(const point_cloud<S, D>& cloud,
                                       const std::vector<bool>& mask, bool chosen) {
  std::vector<std::int32_t> kept;
  for (std::size_t i = 0; i < mask.size(); ++i)
    if (mask[i] == chosen) kept.push_back(static_cast<std::int32_t>(i));
  return gather(cloud, kept);
}

/// The chosen points, with all that belongs to them: in the order of the indices and as often as
/// one is named, otherwise in the order of the cloud. Throws `invalid_input` for an index that is
/// out of range, and for a mask that has not one value per point.
export template <Scalar S, int D, PointChoice W>
[[nodiscard]] point_cloud<S, D> select(const point_cloud<S, D>& cloud, W&& which) {
  expect_consistent(cloud, "select");
  if constexpr (IndexRange<W>) {
    std::vector<std::int32_t> all;
    for (const auto i : which) all.push_back(checked_index(i, cloud.size(), "select"));
    return gather(cloud, all);
  } else {
    return gather(cloud, mask_of(which, cloud.size(), "select"), true);
  }
}

/// All other points than `select` gives, in the order of the cloud. Throws as it does.
export template <Scalar S, int D, PointChoice W>
[[nodiscard]] point_cloud<S, D> exclude(const point_cloud<S, D>& cloud, W&& which) {
  expect_consistent(cloud, "exclude");
  return gather(cloud, mask_of(which, cloud.size(), "exclude"), false);
}

/// The cloud without the points that have a non-finite coordinate, in order, with all that belongs
/// to the others. A cloud without such points is handed on as it is.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> remove_invalid(point_cloud<S, D> cloud) {
  expect_consistent(cloud, "remove_invalid");
  const auto kept = finite_columns(closed_points(cloud));
  if (std::ssize(kept) == cloud.size()) return cloud;
  return gather(cloud, kept);
}

/// Where a filter tells which points of the cloud it was given it has removed: their indices,
/// ascending. May be null.
export using removed_indices = std::vector<index_t>*;

/// The points of a cloud that are kept; the other ones are told.
template <Scalar S, int D>
point_cloud<S, D> keep(const point_cloud<S, D>& cloud, std::span<const std::int32_t> kept,
                       removed_indices removed) {
  if (removed) {
    std::vector<bool> is_kept(cloud.size());
    for (const auto i : kept) is_kept[i] = true;
    removed->clear();
    for (index_t i = 0; i < cloud.size(); ++i)
      if (!is_kept[i]) removed->push_back(i);
  }
  return gather(cloud, kept);
}

/// The cloud without its statistical outliers, in order. See `statistical_outliers`.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> remove_statistical_outliers(
    const point_cloud<S, D>& cloud, const statistical_outlier_options& options = {},
    removed_indices removed = nullptr) {
  expect_consistent(cloud, "remove_statistical_outliers");
  return keep(cloud, statistical_outliers(cloud.points, options).kept, removed);
}

/// The cloud without its radius outliers, in order. See `radius_outliers`.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> remove_radius_outliers(const point_cloud<S, D>& cloud,
                                                       const radius_outlier_options& options,
                                                       removed_indices removed = nullptr) {
  expect_consistent(cloud, "remove_radius_outliers");
  return keep(cloud, radius_outliers(cloud.points, options).kept, removed);
}

/// `count` random points of the cloud, in order, each set equally likely; all if there are no more.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> random_sample(const point_cloud<S, D>& cloud, index_t count,
                                              std::uint64_t seed = 0,
                                              removed_indices removed = nullptr) {
  expect_consistent(cloud, "random_sample");
  return keep(cloud, random_indices(cloud.size(), count, seed), removed);
}

/// `count` points of the cloud at equal steps of the index; all if there are no more.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> uniform_sample(const point_cloud<S, D>& cloud, index_t count,
                                               removed_indices removed = nullptr) {
  expect_consistent(cloud, "uniform_sample");
  return keep(cloud, uniform_indices(cloud.size(), count), removed);
}

/// `count` points of the cloud, each the farthest from all before it, in that order.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> farthest_point_sample(const point_cloud<S, D>& cloud, index_t count,
                                                      const farthest_point_options& options = {},
                                                      removed_indices removed = nullptr) {
  expect_consistent(cloud, "farthest_point_sample");
  return keep(cloud, farthest_point_sample(cloud.points, count, options), removed);
}

#define CILANTRO_COMPILED_ELSEWHERE(S, D) \
  extern template point_cloud<S, D> gather(const point_cloud<S, D>&, std::span<const std::int32_t>);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
