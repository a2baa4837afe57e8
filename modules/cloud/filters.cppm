// SPDX-License-Identifier: MIT
//
// Fewer points of a cloud, with all that belongs to them.
export module cilantro.cloud:filters;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.geometry;
import :point_cloud;

namespace cilantro {

/// Where a filter tells which points of the cloud it was given it has removed: their indices,
/// ascending. May be null.
export using removed_indices = std::vector<index_t>*;

/// The points of a cloud that are kept; the other ones are told.
template <Scalar S, int D>
point_cloud<S, D> keep(const point_cloud<S, D>& cloud, std::span<const std::int32_t> kept,
                       removed_indices removed) {
  if (removed) {
    std::vector<bool> is_kept(static_cast<std::size_t>(cloud.size()));
    for (const auto i : kept) is_kept[static_cast<std::size_t>(i)] = true;
    removed->clear();
    for (index_t i = 0; i < cloud.size(); ++i)
      if (!is_kept[static_cast<std::size_t>(i)]) removed->push_back(i);
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

}  // namespace cilantro
