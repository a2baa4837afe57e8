// SPDX-License-Identifier: MIT
export module cilantro.geometry:voxel_downsample;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :groups;
import :representatives;
import :voxel_grid;

namespace cilantro {

/// Options of `voxel_downsample`.
export struct voxel_downsample_options {
  index_t min_points_per_cell = 1;         ///< Cells with fewer points are left out.
  std::optional<coordinates> origin = {};  ///< A common corner of cells; zero if not given.
  voxel_representative pick = voxel_representative::mean;  ///< Which point represents a cell.
  int threads = 0;
  task_monitor monitor = {};
};

/// One point per occupied cell of a grid, in the order of `voxel_grid`: the mean of the points in
/// it, or one of them. Non-finite points are dropped. Throws as `voxel_grid` and `representatives`
/// do, and for points with an origin.
export template <PointsSource P>
[[nodiscard]] auto voxel_downsample(const P& points, const voxel_size& size,
                                    const voxel_downsample_options& options = {})
    -> point_matrix<scalar_of<P>, dimension_of<P>> {
  expect_local(points, "voxel_downsample");
  const auto view = points_in(points);
  const voxel_grid grid{view,
                        size,
                        {.min_points_per_cell = options.min_points_per_cell,
                         .origin = options.origin,
                         .threads = options.threads,
                         .monitor = options.monitor}};
  const execution how{.threads = options.threads};
  if (options.pick == voxel_representative::mean) return group_means(points, grid.groups(), how);
  const auto picked = representatives(points, grid, options.pick, how);
  point_matrix<scalar_of<P>, dimension_of<P>> kept(view.dimension(), std::ssize(picked));
  for (index_t k = 0; k < kept.cols(); ++k) kept.col(k) = view[picked[k]];
  return kept;
}

}  // namespace cilantro
