// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>
module cilantro.geometry;

namespace cilantro {
namespace {

template <Scalar S>
void expect_valid(const pinhole_camera<S>& camera, const char* who) {
  expects(camera.fx > 0 && camera.fy > 0 && std::isfinite(camera.fx) && std::isfinite(camera.fy),
          std::string{who} + ": the focal lengths must be positive");
}

}  // namespace

template <Scalar S>
point_matrix<S, 3> unproject(const image<std::uint16_t>& depth, const pinhole_camera<S>& camera,
                             const depth_options& options) {
  expect_valid(camera, "unproject");
  expects(depth.width() == camera.width && depth.height() == camera.height,
          "unproject: image and camera must have the same size");
  expects(options.metres_per_unit > 0 && std::isfinite(options.metres_per_unit),
          "unproject: metres_per_unit must be positive");
  constexpr S nan = std::numeric_limits<S>::quiet_NaN();
  const auto scale = static_cast<S>(options.metres_per_unit);
  const Eigen::Matrix<S, 3, 3> rotation = camera.to_world.linear();
  const point_vector<S, 3> position = camera.to_world.translation();

  point_matrix<S, 3> points(3, std::ssize(depth.pixels()));
  index_t i = 0;
  for (int v = 0; v < depth.height(); ++v)
    for (int u = 0; u < depth.width(); ++u, ++i) {
      const std::uint16_t value = depth(u, v);
      if (value == 0 || value == std::numeric_limits<std::uint16_t>::max()) {
        points.col(i).setConstant(nan);
        continue;
      }
      const S z = scale * S(value);
      const point_vector<S, 3> seen{(S(u) - camera.cx) / camera.fx * z,
                                    (S(v) - camera.cy) / camera.fy * z, z};
      points.col(i) = rotation * seen + position;
    }
  return points;
}

template <Scalar S>
image<std::int32_t> closed_project(points_view<S, 3> points, const pinhole_camera<S>& camera,
                                   const projection_options& options) {
  expect_valid(camera, "project");
  expects(options.point_size >= 0 && std::isfinite(options.point_size),
          "project: the point size must not be negative");
  image<std::int32_t> seen(camera.width, camera.height, -1);
  image<S> nearest(camera.width, camera.height, std::numeric_limits<S>::infinity());
  const auto to_camera = camera.to_world.inverse();
  const Eigen::Matrix<S, 3, 3> rotation = to_camera.linear();
  const point_vector<S, 3> origin = to_camera.translation();

  // The pixels from `low` to `high` that are in the image. A comparison with NaN leaves none.
  const auto covered = [](S low, S high, int size) {
    if (!(high >= 0 && low < S(size))) return std::pair{0, -1};
    return std::pair{static_cast<int>(std::max(low, S(0))),
                     static_cast<int>(std::min(high, S(size - 1)))};
  };
  for (index_t i = 0; i < points.size(); ++i) {
    const point_vector<S, 3> p = rotation * points[i] + origin;
    if (!(p.z() > 0)) continue;
    const S half = static_cast<S>(options.point_size) / (2 * p.z());
    const S u = camera.fx * p.x() / p.z() + camera.cx + S(0.5);
    const S v = camera.fy * p.y() / p.z() + camera.cy + S(0.5);
    const auto [left, right] =
        covered(std::floor(u - camera.fx * half), std::floor(u + camera.fx * half), camera.width);
    const auto [top, bottom] =
        covered(std::floor(v - camera.fy * half), std::floor(v + camera.fy * half), camera.height);
    for (int y = top; y <= bottom; ++y)
      for (int x = left; x <= right; ++x)
        if (p.z() < nearest(x, y)) {
          nearest(x, y) = p.z();
          seen(x, y) = static_cast<std::int32_t>(i);
        }
  }
  return seen;
}

template point_matrix<float, 3> unproject(const image<std::uint16_t>&, const pinhole_camera<float>&,
                                          const depth_options&);
template point_matrix<double, 3> unproject(const image<std::uint16_t>&,
                                           const pinhole_camera<double>&, const depth_options&);
template image<std::int32_t> closed_project(points_view<float, 3>, const pinhole_camera<float>&,
                                            const projection_options&);
template image<std::int32_t> closed_project(points_view<double, 3>, const pinhole_camera<double>&,
                                            const projection_options&);

}  // namespace cilantro
