// SPDX-License-Identifier: MIT
//
// Where the quickstart's scan comes from, and how its result becomes a picture.
module;
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
export module scan_io;

import cilantro;
import cilantro.visualization;
import simulated_room;

/// A cloud, and the camera that it is looked at with.
export struct scan {
  cilantro::point_cloud<float, 3> cloud;
  cilantro::pinhole_camera<float> camera;
};

/// The box around the finite points; empty if there are none.
Eigen::AlignedBox3f bounds(const cilantro::point_cloud<float, 3>& cloud) {
  Eigen::AlignedBox3f box;
  for (const auto& p : cilantro::as_points(cloud.points))
    if (cilantro::is_finite(p)) box.extend(p.eval());
  return box;
}

/// The length of the diagonal of the box around the finite points; 1 if there is no such box.
export double diagonal(const cilantro::point_cloud<float, 3>& cloud) {
  const auto box = bounds(cloud);
  const double length = box.isEmpty() ? 0 : double(box.sizes().norm());
  return length > 0 ? length : 1;
}

/// One frame of the simulated depth camera, with the noise of a real one, in the coordinates of the
/// camera of the first one: after `step` steps, as if they had not been made.
export scan simulated_scan(int step = 0) {
  const auto frame = simulate(step, {.noise = 0.0005, .longest_range = 4.5});
  const auto c = simulated_camera(0, {});
  scan result{.camera = {c.width, c.height, float(c.fx), float(c.fy), float(c.cx), float(c.cy),
                         c.to_world.cast<float>()}};
  result.cloud.points = cilantro::unproject(frame.depth, result.camera);
  return result;
}

/// A camera that sees the whole cloud from the front: y up and looking down z, as most models lie.
export cilantro::pinhole_camera<float> camera_in_front_of(
    const cilantro::point_cloud<float, 3>& cloud) {
  cilantro::pinhole_camera<float> camera{640, 480, 700, 700, 320, 240};
  const auto box = bounds(cloud);
  if (box.isEmpty()) return camera;
  camera.to_world.linear() = Eigen::Vector3f{1, -1, -1}.asDiagonal();
  camera.to_world.translation() =
      box.center() + Eigen::Vector3f{0, 0, 1.4f * std::max(box.sizes().norm(), 1e-6f)};
  return camera;
}

/// A cloud, looked at from the front; or a depth image in millimetres, taken to be of a camera with
/// the focal length of a Kinect.
export scan open_scan(const std::filesystem::path& path) {
  scan result;
  if (path.extension() == ".png") {
    const auto depth = cilantro::read_depth_png(path);
    const float focal = 585.0f * float(depth.width()) / 640;
    result.camera = {depth.width(), depth.height(),           focal,
                     focal,         float(depth.width()) / 2, float(depth.height()) / 2};
    result.cloud.points = cilantro::unproject(depth, result.camera);
    return result;
  }
  result.cloud = cilantro::read_cloud<float>(path);
  result.camera = camera_in_front_of(result.cloud);
  return result;
}

/// Two clouds in one picture, the first orange and the second blue.
export template <cilantro::PointCloud A, cilantro::PointCloud B>
cilantro::scene in_two_colors(const A& first, const B& second) {
  using cilantro::cloud_look, cilantro::rgb;
  return cilantro::scene{}
      .set("first", first, cloud_look{.color = rgb{255, 153, 51}})
      .set("second", second, cloud_look{.color = rgb{77, 153, 255}});
}

/// Two pictures of the same height, side by side.
export cilantro::image<cilantro::rgb> side_by_side(const cilantro::image<cilantro::rgb>& left,
                                                   const cilantro::image<cilantro::rgb>& right) {
  cilantro::image<cilantro::rgb> both(left.width() + right.width(), left.height());
  for (int y = 0; y < both.height(); ++y)
    for (int x = 0; x < both.width(); ++x)
      both(x, y) = x < left.width() ? left(x, y) : right(x - left.width(), y);
  return both;
}
