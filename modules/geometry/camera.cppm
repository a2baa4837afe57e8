// SPDX-License-Identifier: MIT
export module cilantro.geometry:camera;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// A camera without lens distortion, and its pose.
///
/// Pixel (u, v) counts from the top left; integers are pixel centres. In the camera's coordinates,
/// with x to the right, y down and z ahead, a point (x, y, z) is seen at (fx·x/z + cx, fy·y/z +
/// cy).
export template <Scalar S>
struct pinhole_camera {
  int width, height;  ///< In pixels.
  S fx, fy;           ///< Focal lengths in pixels.
  S cx, cy;           ///< The principal point: the pixel that looks straight ahead.
  /// The pose: from the camera's coordinates to those of the world.
  Eigen::Transform<S, 3, Eigen::Isometry> to_world =
      Eigen::Transform<S, 3, Eigen::Isometry>::Identity();
};

/// Throws `invalid_input`, naming the function `who`, for focal lengths that are not positive and
/// finite.
template <Scalar S>
void expect_valid(const pinhole_camera<S>& camera, const char* who) {
  expects(camera.fx > 0 && camera.fy > 0 && std::isfinite(camera.fx) && std::isfinite(camera.fy),
          std::string{who} + ": the focal lengths must be positive");
}

}  // namespace cilantro
