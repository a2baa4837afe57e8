// SPDX-License-Identifier: MIT
export module cilantro.geometry:representatives;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :groups;
import :voxel_grid;

namespace cilantro {

/// Which point represents a cell when a cloud is reduced to one point per cell.
export enum class voxel_representative {
  mean,               ///< The mean of its points: a new point.
  first,              ///< Its first point.
  nearest_to_center,  ///< The point nearest to the centre of the cell, or the first of several.
  /// The point whose normal is closest to those of all others: it has the smallest sum of the
  /// squared sines of the angles between them, which does not depend on the signs of normals. The
  /// first of several.
  medoid_of_normals,
};

template <Scalar S, int D>
index_list closed_nearest_to_centers(points_view<S, D> points, const point_groups& groups,
                                     const cell_layout<D>& layout, const execution& how);
template <Scalar S, int D>
index_list closed_medoids(points_view<S, D> normals, const point_groups& groups,
                          const execution& how);

/// The first member of each group. Throws `invalid_input` for an empty group.
export [[nodiscard]] index_list first_of_groups(const point_groups& groups);

/// The point of each cell that is nearest to its centre, in the order of the cells.
/// `points` must be those of the grid.
export template <PointsSource P>
[[nodiscard]] index_list nearest_to_centers(const P& points,
                                            const voxel_grid<scalar_of<P>, dimension_of<P>>& grid,
                                            const execution& how = {}) {
  constexpr int C = closed_dimension<dimension_of<P>>;
  return closed_nearest_to_centers<scalar_of<P>, C>(points_in(points), grid.groups(),
                                                    {grid.edges(), grid.origin()}, how);
}

/// The member of each group whose normal is closest to those of the others; see
/// `voxel_representative`. Normals that are zero or not finite are chosen only if there is no
/// other.
export template <PointwiseVectors P>
[[nodiscard]] index_list medoids_of_normals(const P& normals, const point_groups& groups,
                                            const execution& how = {}) {
  return closed_medoids(closed_points(normals), groups, how);
}

/// The index of the point that represents each cell. `points` must be those of the grid. Throws
/// `invalid_input` if `pick` is the mean, which is not one of the points, or if normals are to be
/// compared and the points have none.
export template <PointsSource P>
[[nodiscard]] index_list representatives(const P& points,
                                         const voxel_grid<scalar_of<P>, dimension_of<P>>& grid,
                                         voxel_representative pick, const execution& how = {}) {
  expects(pick != voxel_representative::mean, "representatives: a mean is not one of the points");
  if (pick == voxel_representative::first) return first_of_groups(grid.groups());
  if (pick == voxel_representative::nearest_to_center) return nearest_to_centers(points, grid, how);
  const auto normals = normals_in(points);
  expects(!normals.empty() || points_in(points).empty(),
          "representatives: there are no normals to compare; estimate them first");
  return medoids_of_normals(normals, grid.groups(), how);
}

}  // namespace cilantro
