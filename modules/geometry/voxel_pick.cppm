// SPDX-License-Identifier: MIT
export module cilantro.geometry:voxel_pick;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :voxel_grid;

namespace cilantro {

/// What stands for a cell when a cloud is reduced to one point per cell.
export enum class voxel_pick {
  mean,               ///< The mean of its points: a new point.
  first,              ///< Its first point.
  nearest_to_center,  ///< The point nearest to the centre of the cell, or the first of several.
  /// The point whose normal is closest to those of all others, by the sum of the squared sines of
  /// the angles between them, which does not depend on their signs; the first of several.
  medoid_of_normals,
};

template <Scalar S, int D>
std::vector<std::int32_t> closed_nearest_to_centers(points_view<S, D> points,
                                                    const point_groups& groups,
                                                    const cell_layout<D>& layout,
                                                    const execution& how);
template <Scalar S, int D>
std::vector<std::int32_t> closed_medoids(points_view<S, D> normals, const point_groups& groups,
                                         const execution& how);

/// The first member of each group.
export [[nodiscard]] std::vector<std::int32_t> first_of_groups(const point_groups& groups);

/// The point of each cell that is nearest to its centre, in the order of the cells.
/// `points` must be those of the grid.
export template <PointsSource P>
[[nodiscard]] std::vector<std::int32_t> nearest_to_centers(
    const P& points, const voxel_grid<scalar_of<P>, dimension_of<P>>& grid,
    const execution& how = {}) {
  constexpr int C = closed_dimension<dimension_of<P>>;
  return closed_nearest_to_centers<scalar_of<P>, C>(points_in(points), grid.groups(),
                                                    {grid.edges(), grid.origin()}, how);
}

/// The member of each group whose normal is closest to those of the others. Normals that are zero
/// or not finite are chosen only where there is no other.
export template <PointwiseVectors P>
[[nodiscard]] std::vector<std::int32_t> medoids_of_normals(const P& normals,
                                                           const point_groups& groups,
                                                           const execution& how = {}) {
  return closed_medoids(closed_points(normals), groups, how);
}

/// The point that stands for each cell; `pick` is not the mean. `points` must be those of the grid.
/// Throws `invalid_input` if normals are to be compared and the points have none.
export template <PointsSource P>
[[nodiscard]] std::vector<std::int32_t> representatives(
    const P& points, const voxel_grid<scalar_of<P>, dimension_of<P>>& grid, voxel_pick pick,
    const execution& how = {}) {
  expects(pick != voxel_pick::mean, "representatives: a mean is none of the points");
  if (pick == voxel_pick::first) return first_of_groups(grid.groups());
  if (pick == voxel_pick::nearest_to_center) return nearest_to_centers(points, grid, how);
  const auto normals = normals_in(points);
  expects(!normals.empty() || points_in(points).empty(),
          "representatives: there are no normals to compare; estimate them first");
  return medoids_of_normals(normals, grid.groups(), how);
}

/// How `voxel_downsample` reduces points or a cloud.
export struct voxel_downsample_options {
  index_t min_points = 1;                  ///< Cells with fewer points are left out.
  std::optional<coordinates> origin = {};  ///< A corner that cells share; zero if none is given.
  voxel_pick pick = voxel_pick::mean;      ///< What stands for a cell.
  int threads = 0;
  task_monitor monitor = {};
};

/// One point per occupied cell of a grid, in the order of `voxel_grid`: the mean of the points in
/// it, or one of them. Non-finite points are dropped. Throws as `voxel_grid` and `representatives`
/// do.
export template <PointsSource P>
[[nodiscard]] auto voxel_downsample(const P& points, const voxel_size& size,
                                    const voxel_downsample_options& options = {})
    -> point_matrix<scalar_of<P>, dimension_of<P>> {
  expect_local(points, "voxel_downsample");
  const auto view = points_in(points);
  const voxel_grid grid{
      view, size, {options.min_points, options.origin, options.threads, options.monitor}};
  const execution how{.threads = options.threads};
  if (options.pick == voxel_pick::mean) return group_means(points, grid.groups(), how);
  const auto picked = representatives(points, grid, options.pick, how);
  point_matrix<scalar_of<P>, dimension_of<P>> kept(view.dimension(), std::ssize(picked));
  for (index_t k = 0; k < kept.cols(); ++k) kept.col(k) = view[picked[static_cast<std::size_t>(k)]];
  return kept;
}

}  // namespace cilantro
