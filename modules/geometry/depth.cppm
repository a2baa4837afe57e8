// SPDX-License-Identifier: MIT
export module cilantro.geometry:depth;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// A camera without lens distortion, and where it stands.
///
/// Pixel (u, v) counts from the top left, integers are pixel centres, and a point (x, y, z) in
/// front of the camera, x to the right, y down and z ahead, is seen at (fx·x/z + cx, fy·y/z + cy).
export template <Scalar S>
struct pinhole_camera {
  int width, height;  ///< In pixels.
  S fx, fy;           ///< Focal lengths in pixels.
  S cx, cy;           ///< The pixel that looks straight ahead.
  Eigen::Transform<S, 3, Eigen::Isometry> to_world =
      Eigen::Transform<S, 3, Eigen::Isometry>::Identity();
};

export struct depth_options {
  double metres_per_unit = 0.001;  ///< Of the 16-bit values, which measure z, not the distance.
};

/// The points that a depth image shows, in world coordinates: one a pixel, row by row, NaN where
/// the image says nothing (a depth of 0 or of 65535), so that the neighbours of a pixel stay its
/// neighbours; `remove_invalid` makes them compact.
/// Throws `invalid_input` if image and camera differ in size, or for focal lengths or a scale that
/// are not positive.
export template <Scalar S>
[[nodiscard]] point_matrix<S, 3> unproject(const image<std::uint16_t>& depth,
                                           const pinhole_camera<S>& camera,
                                           const depth_options& options = {});

export struct projection_options {
  /// The edge of the square, facing the camera, that a point covers, in metres. At 0 it covers the
  /// one pixel that it falls into; the size of the voxels leaves no gaps in a downsampled cloud.
  double point_size = 0;
};

template <Scalar S>
image<std::int32_t> closed_project(points_view<S, 3> points, const pinhole_camera<S>& camera,
                                   const projection_options& options);

/// Which point is seen in each pixel: the index of the nearest one that covers it, −1 where there
/// is none. Points behind the camera, outside the image, or not finite are not seen; of two at the
/// same depth it is the first. Throws `invalid_input` for focal lengths that are not positive, or a
/// negative point size.
export template <PointsSource P>
  requires(dimension_of<P> == 3)
[[nodiscard]] image<std::int32_t> project(const P& points,
                                          const pinhole_camera<scalar_of<P>>& camera,
                                          const projection_options& options = {}) {
  return closed_project<scalar_of<P>>(points_in(points), camera, options);
}

}  // namespace cilantro
