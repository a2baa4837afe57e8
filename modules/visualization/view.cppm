// SPDX-License-Identifier: MIT
export module cilantro.visualization:view;

import cilantro.standard;
import cilantro.core;
import cilantro.geometry;
import :scene;

namespace cilantro {

/// From where a scene is seen, and how: a camera. A value; `orbit`, `pan` and `zoom` make another
/// one of it.
export struct view {
  /// Any focal lengths and principal point; the size is that of the picture.
  pinhole_camera<double> camera = {1280, 720, 869, 869, 639.5, 359.5};
  /// Parallel rays: then the focal lengths are pixels per unit of length, at every distance.
  bool orthographic = false;
  /// How far ahead what is looked at is: `orbit` turns around it.
  double distance = 1;
  /// What `orbit` keeps upright, of any length.
  Eigen::Vector3d up = -Eigen::Vector3d::UnitY();

  view() = default;
  /// What a camera sees. Its own up is up.
  template <Scalar S>
  explicit view(const pinhole_camera<S>& from, double looks_at_distance = 1)
      : camera{from.width,
               from.height,
               double(from.fx),
               double(from.fy),
               double(from.cx),
               double(from.cy),
               from.to_world.template cast<double>()},
        distance{looks_at_distance},
        up{-camera.to_world.linear().col(1)} {}

  /// Where it is seen from, and where it looks.
  [[nodiscard]] Eigen::Vector3d eye() const { return camera.to_world.translation(); }
  [[nodiscard]] Eigen::Vector3d ahead() const { return camera.to_world.linear().col(2); }
};

/// Throws `invalid_input`, naming the function `who`, for a camera without pixels, or whose numbers
/// are not finite, or whose focal lengths not positive.
void expect_camera(const pinhole_camera<double>& camera, const char* who);
/// As above, and for a view whose distance is not positive and finite.
void expect_view(const view& from, const char* who);

/// Options of `look_at` and `fit`.
export struct view_options {
  int width = 1280, height = 720;  ///< Of the picture, in pixels.
  /// From the left to the right border or from top to bottom, whichever is less, in radians; less
  /// than π.
  double field_of_view = 0.7853981633974483;
  bool orthographic = false;  ///< Parallel rays.
};

/// The view from `eye` to `at`, with `up` upwards in the picture. If parallel, what is as far away
/// as `at` has the size that the field of view would give it. Throws `invalid_input` for places
/// that are equal or not finite, for a direction along `up`, and for options that make no sense.
export [[nodiscard]] view look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& at,
                                  const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ(),
                                  const view_options& options = {});

/// The view of all of a scene in the given direction. Without one, from a little above with z
/// upwards; of what lies in a plane of constant z, straight from above with y upwards. Of an empty
/// scene, what is around 0. Throws as `look_at` does.
export [[nodiscard]] view fit(const scene& all, const view_options& options = {});
export [[nodiscard]] view fit(const scene& all, const Eigen::Vector3d& direction,
                              const Eigen::Vector3d& up, const view_options& options = {});

/// The share of the distance of a view within which nothing is seen.
inline constexpr double nearest_share = 1e-3;

/// Angles that a view is turned by, in radians.
export struct orbit_angles {
  double right = 0;  ///< The eye goes to the right, around what is up.
  double up = 0;     ///< The eye rises, to just below the zenith at most.
};
/// Turns a view around what it looks at. Throws `invalid_input` for a view or angles that are not
/// finite, or if up is ahead.
export [[nodiscard]] view orbit(view from, const orbit_angles& angles);

/// How far the picture is moved, in pixels.
export struct pan_pixels {
  double right = 0, down = 0;  ///< What is at the distance of the view moves by as many.
};
/// Moves a view sideways, so that the picture moves. Throws `invalid_input` for what is not finite.
export [[nodiscard]] view pan(view from, const pan_pixels& by);

/// Moves a view ahead, so that what it looks at becomes `factor` times as large.
export [[nodiscard]] view zoom(view from, positive factor);

/// So many views all around what is looked at, the first being `from`. Throws `invalid_input` for
/// fewer than 1 or more than 100,000, and as `orbit` does.
export [[nodiscard]] std::vector<view> turntable(const view& from, int count);

}  // namespace cilantro
