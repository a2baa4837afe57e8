// SPDX-License-Identifier: MIT
//
// Normals of a cloud, and its reduction by a grid.
module;
#include "core/closed_spaces.hpp"
export module cilantro.cloud:estimate;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.geometry;
import :attribute;
import :choice;
import :point_cloud;

namespace cilantro {

/// The options with the viewpoint in the cloud's local coordinates.
template <Scalar S, int D>
normals_options local_to(const point_cloud<S, D>& cloud, normals_options options) {
  if (options.viewpoint) options.viewpoint = cloud.to_local(*options.viewpoint);
  return options;
}

template <Scalar S, int D>
point_cloud<S, D> with_normals(point_cloud<S, D>&& cloud, normals_result<S, D>&& found) {
  cloud.normals = std::move(found.normals);
  cloud.set_attribute("curvature", std::vector<S>(found.curvature.data(),
                                                  found.curvature.data() + found.curvature.size()));
  return std::move(cloud);
}

/// The cloud with estimated normals, and the curvatures as its attribute "curvature"; both replace
/// existing ones. Everything else is kept. See `estimate_normals` for points.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> estimate_normals(point_cloud<S, D> cloud, neighborhood_spec spec,
                                                 const normals_options& options = {}) {
  expect_consistent(cloud, "estimate_normals");
  return with_normals(std::move(cloud),
                      estimate_normals(cloud.points, spec, local_to(cloud, options)));
}

/// As above, from the covariance that an estimator finds for each neighbourhood.
export template <Scalar S, int D, CovarianceEstimator<S, D> E>
[[nodiscard]] point_cloud<S, D> estimate_normals(point_cloud<S, D> cloud, neighborhood_spec spec,
                                                 const E& estimate,
                                                 const normals_options& options = {}) {
  expect_consistent(cloud, "estimate_normals");
  return with_normals(std::move(cloud),
                      estimate_normals(cloud.points, spec, estimate, local_to(cloud, options)));
}

/// As above, from neighbourhoods that any searcher has found.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> estimate_normals(point_cloud<S, D> cloud,
                                                 const neighborhoods<S>& near,
                                                 const normals_options& options = {}) {
  expect_consistent(cloud, "estimate_normals");
  return with_normals(std::move(cloud),
                      estimate_normals(cloud.points, near, local_to(cloud, options)));
}
export template <Scalar S, int D, CovarianceEstimator<S, D> E>
[[nodiscard]] point_cloud<S, D> estimate_normals(point_cloud<S, D> cloud,
                                                 const neighborhoods<S>& near, const E& estimate,
                                                 const normals_options& options = {}) {
  expect_consistent(cloud, "estimate_normals");
  return with_normals(std::move(cloud),
                      estimate_normals(cloud.points, near, estimate, local_to(cloud, options)));
}

/// One point per occupied cell, as `voxel_downsample` for points. By default, the mean of the
/// points, of the normals (flipped to one side, at unit length) and of the colours in the cell,
/// with the mean of floating-point attributes and the lower median of integer ones. Otherwise, one
/// of the points of the cell, with all that belongs to it. Cells are aligned in world coordinates,
/// whatever the cloud's origin. Throws as `voxel_grid` does, and if normals are to be compared and
/// there are none. Memory beside the result: about 24 bytes per point.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> voxel_downsample(const point_cloud<S, D>& cloud,
                                                 const voxel_size& size,
                                                 const voxel_downsample_options& options = {}) {
  expect_consistent(cloud, "voxel_downsample");
  voxel_options cells{.min_points_per_cell = options.min_points_per_cell,
                      .origin = options.origin,
                      .threads = options.threads,
                      .monitor = options.monitor};
  if (cloud.has_origin())
    cells.origin = cloud.to_local(cells.origin.value_or(
        coordinates{point_vector<double, D>::Zero(cloud.dimension()).eval()}));
  const voxel_grid<S, D> grid{as_points(cloud.points), size, cells};
  const execution how{.threads = options.threads};
  if (options.pick != voxel_representative::mean)
    return gather(cloud, representatives(cloud, grid, options.pick, how));
  point_cloud<S, D> reduced;
  reduced.points = group_means(cloud.points, grid.groups(), how);
  if (cloud.has_normals()) reduced.normals = group_directions(cloud.normals, grid.groups(), how);
  if (cloud.has_colors()) reduced.colors = group_means(cloud.colors, grid.groups(), how);
  for (const auto& a : cloud.attributes) reduced.attributes.push_back(reduce(a, grid.groups()));
  reduced.comments = cloud.comments;
  reduced.origin = cloud.origin;
  return reduced;
}

/// The cloud with each normal flipped towards `viewpoint`, in world coordinates. Throws
/// `invalid_input` if it has no normals.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> orient_to_viewpoint(point_cloud<S, D> cloud,
                                                    const coordinates& viewpoint) {
  expect_consistent(cloud, "orient_to_viewpoint");
  expects(cloud.has_normals() || cloud.empty(),
          "orient_to_viewpoint: the cloud has no normals; estimate them first");
  if (cloud.has_normals())
    orient_to_viewpoint(cloud.normals, cloud.points, cloud.to_local(viewpoint));
  return cloud;
}

/// The cloud with its normals flipped so that neighbours agree over the whole surface, as
/// `orient_consistently` for points. Throws `invalid_input` if it has no normals.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> orient_consistently(point_cloud<S, D> cloud, neighborhood_spec spec,
                                                    orientation_options options = {}) {
  expect_consistent(cloud, "orient_consistently");
  expects(cloud.has_normals() || cloud.empty(),
          "orient_consistently: the cloud has no normals; estimate them first");
  if (options.viewpoint) options.viewpoint = cloud.to_local(*options.viewpoint);
  if (cloud.has_normals()) orient_consistently(cloud.normals, cloud.points, spec, options);
  return cloud;
}

#define CILANTRO_COMPILED_ELSEWHERE(S, D)                                                         \
  extern template point_cloud<S, D> estimate_normals(point_cloud<S, D>, neighborhood_spec,        \
                                                     const normals_options&);                     \
  extern template point_cloud<S, D> voxel_downsample(const point_cloud<S, D>&, const voxel_size&, \
                                                     const voxel_downsample_options&);            \
  extern template point_cloud<S, D> orient_to_viewpoint(point_cloud<S, D>, const coordinates&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
