// SPDX-License-Identifier: MIT
//
// What the mouse and the keys do to views. Internal.
module cilantro.window:navigation;

import cilantro.standard;
import cilantro.visualization;

namespace cilantro {

/// The same view in a picture of another size, as `render` draws it there.
[[nodiscard]] view resized(view from, int width, int height) {
  auto& camera = from.camera;
  if (camera.width == width && camera.height == height) return from;
  const auto there = detail::camera_of(from, width, height);
  camera.fx = there.fx;
  camera.fy = there.fy;
  camera.cx = there.cx;
  camera.cy = there.cy;
  camera.width = width;
  camera.height = height;
  return from;
}

/// What is seen follows the mouse: from one border to the other, it is turned by half a circle.
[[nodiscard]] view turned(const view& from, double right, double down, double window_width) {
  const double angle = std::numbers::pi / window_width;
  return orbit(from, {.right = -right * angle, .up = down * angle});
}

/// Each step of the wheel makes what is looked at a tenth larger.
[[nodiscard]] view zoomed(const view& from, double steps) {
  const view result = zoom(from, std::pow(1.1, std::clamp(steps, -50.0, 50.0)));
  // Beyond that, nothing would be seen any more.
  const double scale = result.orthographic ? result.camera.fx : result.distance;
  constexpr double most = 1e30;
  return 1 / most < scale && scale < most ? result : from;
}
/// The same of a view by parallel rays, so that what is at a pixel stays there.
[[nodiscard]] view zoomed_at(const view& from, double steps, double x, double y) {
  const view result = zoomed(from, steps);
  const double share = 1 - result.camera.fx / from.camera.fx;
  return pan(result, {.right = share * (x - from.camera.cx), .down = share * (y - from.camera.cy)});
}

/// Moves a view sideways, so that a place is in the middle, and looks at it.
[[nodiscard]] view centered_on(view from, const Eigen::Vector3d& place) {
  auto& to_world = from.camera.to_world;
  const Eigen::Vector3d seen = to_world.inverse() * place;
  const double depth = from.orthographic ? 1 : seen.z();
  const Eigen::Vector2d middle{
      ((from.camera.width - 1) / 2.0 - from.camera.cx) / from.camera.fx * depth,
      ((from.camera.height - 1) / 2.0 - from.camera.cy) / from.camera.fy * depth};
  to_world.translation() += to_world.linear().leftCols<2>() * (seen.head<2>() - middle);
  from.distance = seen.z();
  return from;
}

/// The same view by parallel rays: what it looks at has the same size.
[[nodiscard]] view by_parallel_rays(view from) {
  from.camera.fx /= from.distance;
  from.camera.fy /= from.distance;
  from.orthographic = true;
  return from;
}

/// The same view from an eye, with a focal length of so many pixels along x.
[[nodiscard]] view from_an_eye(view from, double focal_length) {
  const Eigen::Vector3d at = from.eye() + from.distance * from.ahead();
  from.distance = focal_length / from.camera.fx;
  from.camera.fx *= from.distance;
  from.camera.fy *= from.distance;
  from.camera.to_world.translation() = at - from.distance * from.ahead();
  from.orthographic = false;
  return from;
}

}  // namespace cilantro
