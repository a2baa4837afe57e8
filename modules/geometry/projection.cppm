// SPDX-License-Identifier: MIT
export module cilantro.geometry:projection;

import cilantro.standard;
import cilantro.core;
import :camera;

namespace cilantro {

/// Options of `project` and `project_depth`.
export struct projection_options {
  /// Each point covers a square with this edge, in metres, that faces the camera. At 0, it covers
  /// only the pixel that it falls into. For a downsampled cloud, the size of the voxels leaves no
  /// gaps.
  double point_size = 0;
  int threads = 0;
  task_monitor monitor = {};
};

template <Scalar S>
image<std::int32_t> closed_project(points_view<S, 3> points, const pinhole_camera<S>& camera,
                                   const projection_options& options);
template <Scalar S>
image<S> closed_depth_of(points_view<S, 3> points, const image<std::int32_t>& seen,
                         const pinhole_camera<S>& camera);

/// Which point each pixel shows: the index of the nearest point that covers it, −1 where there is
/// none. Points behind the camera, outside the image, or not finite are not shown; of two at the
/// same depth, the one with the smaller index is, for any number of threads. Throws `invalid_input`
/// for focal lengths that are not positive, or a negative point size.
export template <PointsSource P>
  requires(dimension_of<P> == 3)
[[nodiscard]] image<std::int32_t> project(const P& points,
                                          const pinhole_camera<scalar_of<P>>& camera,
                                          const projection_options& options = {}) {
  expect_local(points, "project");
  return closed_project<scalar_of<P>>(points_in(points), camera, options);
}

/// The depth in metres of the point that each pixel shows, 0 where there is none.
export template <PointsSource P>
  requires(dimension_of<P> == 3)
[[nodiscard]] image<scalar_of<P>> project_depth(const P& points,
                                                const pinhole_camera<scalar_of<P>>& camera,
                                                const projection_options& options = {}) {
  expect_local(points, "project_depth");
  const auto view = points_in(points);
  return closed_depth_of<scalar_of<P>>(view, closed_project<scalar_of<P>>(view, camera, options),
                                       camera);
}

/// A picture of the points that `project` has found: `value(i)` where a pixel shows point i,
/// `background` where it shows none.
export template <class F>
  requires std::invocable<const F&, index_t>
[[nodiscard]] auto paint(
    const image<std::int32_t>& seen, const F& value,
    const std::remove_cvref_t<std::invoke_result_t<const F&, index_t>>& background = {}) {
  image<std::remove_cvref_t<std::invoke_result_t<const F&, index_t>>> picture(
      seen.width(), seen.height(), background);
  for (std::size_t i = 0; i < seen.pixels().size(); ++i)
    if (seen.pixels()[i] >= 0) picture.pixels()[i] = value(index_t{seen.pixels()[i]});
  return picture;
}

}  // namespace cilantro
