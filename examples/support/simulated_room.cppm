// SPDX-License-Identifier: MIT
//
// A depth camera in a furnished room, by ray casting: an input that everyone has, with the exact
// truth beside it. Examples, tests and benchmarks use it.
module;
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <variant>
#include <vector>
export module simulated_room;

import cilantro;

using Eigen::Vector3d;

namespace {

/// Where a ray meets a surface: the distance along it in units of its direction, and the normal
/// there.
struct hit {
  double distance;
  Vector3d normal;
};

struct ray {
  Vector3d origin, direction;
  [[nodiscard]] Vector3d at(double t) const { return origin + t * direction; }
};

struct box {
  Vector3d low, high;

  [[nodiscard]] std::optional<hit> meet(const ray& r) const {
    double enter = 0, leave = std::numeric_limits<double>::infinity();
    int enter_axis = -1, leave_axis = -1;
    for (int d = 0; d < 3; ++d) {
      double near = (low[d] - r.origin[d]) / r.direction[d];
      double far = (high[d] - r.origin[d]) / r.direction[d];
      if (near > far) std::swap(near, far);
      if (near > enter) enter = near, enter_axis = d;
      if (far < leave) leave = far, leave_axis = d;
    }
    if (enter > leave || leave <= 0) return std::nullopt;
    // From within, which is where the camera is in the room, the far side is what is seen.
    const bool within = enter_axis < 0;
    const int axis = within ? leave_axis : enter_axis;
    Vector3d normal = Vector3d::Zero();
    normal[axis] = r.direction[axis] > 0 ? -1 : 1;
    return hit{within ? leave : enter, normal};
  }
};

std::optional<double> first_root(double a, double half_b, double c) {
  const double discriminant = half_b * half_b - a * c;
  if (a == 0 || discriminant < 0) return std::nullopt;
  const double root = (-half_b - std::sqrt(discriminant)) / a;
  return root > 0 ? std::optional{root} : std::nullopt;
}

struct sphere {
  Vector3d center;
  double radius;

  [[nodiscard]] std::optional<hit> meet(const ray& r) const {
    const Vector3d from_center = r.origin - center;
    const auto t = first_root(r.direction.squaredNorm(), r.direction.dot(from_center),
                              from_center.squaredNorm() - radius * radius);
    if (!t) return std::nullopt;
    return hit{*t, (r.at(*t) - center) / radius};
  }
};

/// Upright, without lids.
struct cylinder {
  Vector3d foot;
  double radius, height;

  [[nodiscard]] std::optional<hit> meet(const ray& r) const {
    const Vector3d flat{r.direction.x(), r.direction.y(), 0};
    const Vector3d from_axis{r.origin.x() - foot.x(), r.origin.y() - foot.y(), 0};
    const auto t = first_root(flat.squaredNorm(), flat.dot(from_axis),
                              from_axis.squaredNorm() - radius * radius);
    if (!t) return std::nullopt;
    const Vector3d p = r.at(*t);
    if (p.z() < foot.z() || p.z() > foot.z() + height) return std::nullopt;
    return hit{*t, Vector3d{p.x() - foot.x(), p.y() - foot.y(), 0} / radius};
  }
};

using surface = std::variant<box, sphere, cylinder>;

/// In metres, z up, the floor at 0. The first surface is the room itself.
const std::array<surface, 12> furniture{
    box{{-3, -2.5, 0}, {3, 2.5, 2.6}},         // walls, floor and ceiling
    box{{0.6, -0.8, 0.70}, {2.0, 0.8, 0.75}},  // a table top on four legs
    cylinder{{0.7, -0.7, 0}, 0.04, 0.7},
    cylinder{{1.9, -0.7, 0}, 0.04, 0.7},
    cylinder{{0.7, 0.7, 0}, 0.04, 0.7},
    cylinder{{1.9, 0.7, 0}, 0.04, 0.7},
    box{{2.4, -2.5, 0}, {3.0, -1.2, 1.9}},       // a cupboard
    box{{1.0, -0.5, 0.75}, {1.35, -0.1, 0.95}},  // on the table: a box, a ball and a can
    sphere{{1.3, 0.35, 0.90}, 0.15},
    cylinder{{0.85, 0.1, 0.75}, 0.06, 0.2},
    sphere{{0.2, 1.6, 0.30}, 0.30},  // on the floor: a ball and a bin
    cylinder{{2.6, 1.9, 0}, 0.22, 0.6},
};

/// A curtain with folds that hangs before the wall and billows: x as a function of the place in the
/// cloth, and a shift along y, both growing from the rail down.
struct curtain {
  static constexpr double left = -1.1, right = 1.3, rail = 2.3, length = 1.8;
  double swing;

  explicit curtain(double seconds) : swing{std::sin(seconds)} {}

  [[nodiscard]] static double slack(double z) { return std::pow((rail - z) / length, 2); }
  [[nodiscard]] static double slack_slope(double z) { return -2 * (rail - z) / (length * length); }
  [[nodiscard]] double shift(double z) const { return 0.05 * swing * slack(z); }
  [[nodiscard]] double x(double u, double z) const {
    return 2.6 - 0.04 * std::sin(14 * u) - 0.2 * swing * slack(z) * (1 + 0.5 * std::sin(2 * u));
  }
  [[nodiscard]] Vector3d at(double u, double z) const { return {x(u, z), u + shift(z), z}; }
  [[nodiscard]] Vector3d normal(double u, double z) const {
    const double by_u = -0.56 * std::cos(14 * u) - 0.2 * swing * slack(z) * std::cos(2 * u);
    const double by_z = -0.2 * swing * slack_slope(z) * (1 + 0.5 * std::sin(2 * u)) -
                        by_u * 0.05 * swing * slack_slope(z);
    return Vector3d{1, -by_u, -by_z}.normalized();
  }

  /// From the room, not along the cloth, where a ray would meet several folds.
  [[nodiscard]] std::optional<hit> meet(const ray& r) const {
    const auto reach = [&](double plane) { return (plane - r.origin.x()) / r.direction.x(); };
    double before = reach(2.2), behind = reach(3);
    if (!(0 < before && before < behind)) return std::nullopt;
    const auto place = [&](double t) {
      const Vector3d p = r.at(t);
      return std::pair{p.y() - shift(p.z()), p.z()};
    };
    for (int halving = 0; halving < 50; ++halving) {
      const double middle = (before + behind) / 2;
      const auto [u, z] = place(middle);
      (r.at(middle).x() < x(u, z) ? before : behind) = middle;
    }
    const auto [u, z] = place(before);
    if (u < left || u > right || z < rail - length || z > rail) return std::nullopt;
    return hit{before, normal(u, z)};
  }
};

}  // namespace

/// The number of the curtain among the objects of a frame.
export constexpr std::int32_t curtain_object = std::int32_t(furniture.size());

/// The truth: where the point of the curtain that is at `start` at 0 seconds, or the part of the
/// room, is at another time.
export [[nodiscard]] Vector3d moved_in_room(const Vector3d& start, std::int32_t object,
                                            double seconds) {
  return object == curtain_object ? curtain{seconds}.at(start.y(), start.z()) : start;
}

/// What one pose of the camera sees.
export struct simulated_frame {
  cilantro::pinhole_camera<double> camera;
  cilantro::image<std::uint16_t> depth;  ///< Millimetres along the optical axis; 0: nothing.
  Eigen::Matrix3Xd points;   ///< The truth: where the ray of each pixel ends, in the world.
  Eigen::Matrix3Xd normals;  ///< The truth: the surface there, turned to the camera.
  /// The truth: the number of the surface; 0 is the room.
  std::vector<std::int32_t> objects;
};

export struct simulation_options {
  int width = 640;
  int height = 480;
  /// Standard deviation of the depth noise at 2 m, in metres; it grows with the square of the
  /// distance.
  double noise = 0;
  double longest_range = 8;  ///< What is farther away has no depth, in metres.
  /// When the frame is taken, in seconds, if there is a curtain before the wall, which billows.
  std::optional<double> curtain_seconds = {};
  std::uint64_t seed = 0;
};

/// The camera after `step` of the many small steps of a walk around the table, 1.4 m above the
/// floor.
export [[nodiscard]] cilantro::pinhole_camera<double> simulated_camera(
    int step, const simulation_options& o) {
  const double angle = std::numbers::pi + 0.02 * step;
  const Vector3d middle{1.0, 0, 0.8};
  const Vector3d eye = middle + Vector3d{2.6 * std::cos(angle), 1.6 * std::sin(angle), 0.6};
  const Vector3d ahead = (middle - eye).normalized();
  const Vector3d right = ahead.cross(Vector3d::UnitZ()).normalized();
  cilantro::pinhole_camera<double> camera{.width = o.width,
                                          .height = o.height,
                                          .fx = 0.9 * o.width,
                                          .fy = 0.9 * o.width,
                                          .cx = (o.width - 1) / 2.0,
                                          .cy = (o.height - 1) / 2.0};
  camera.to_world.linear().col(0) = right;
  camera.to_world.linear().col(1) = ahead.cross(right);
  camera.to_world.linear().col(2) = ahead;
  camera.to_world.translation() = eye;
  return camera;
}

export [[nodiscard]] simulated_frame simulate(int step, const simulation_options& options = {}) {
  simulated_frame frame;
  frame.camera = simulated_camera(step, options);
  const auto& camera = frame.camera;
  frame.depth = {camera.width, camera.height};
  const cilantro::index_t pixels = std::ssize(frame.depth.pixels());
  frame.points.resize(3, pixels);
  frame.normals.resize(3, pixels);
  frame.objects.resize(static_cast<std::size_t>(pixels));

  cilantro::parallel_for(pixels, {}, [&](cilantro::index_t i) {
    const int u = static_cast<int>(i % camera.width), v = static_cast<int>(i / camera.width);
    // With 1 along the optical axis, the distance along the ray is the depth.
    const Vector3d seen{(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1};
    const ray r{camera.to_world.translation(), camera.to_world.linear() * seen};
    hit nearest{std::numeric_limits<double>::infinity(), Vector3d::Zero()};
    for (std::size_t s = 0; s < furniture.size(); ++s) {
      const auto found = std::visit([&](const auto& shape) { return shape.meet(r); }, furniture[s]);
      if (!found || found->distance >= nearest.distance) continue;
      nearest = *found;
      frame.objects[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(s);
    }
    if (options.curtain_seconds)
      if (const auto found = curtain{*options.curtain_seconds}.meet(r);
          found && found->distance < nearest.distance) {
        nearest = *found;
        frame.objects[static_cast<std::size_t>(i)] = curtain_object;
      }
    frame.points.col(i) = r.at(nearest.distance);
    frame.normals.col(i) =
        nearest.normal.dot(r.direction) > 0 ? Vector3d{-nearest.normal} : nearest.normal;

    cilantro::random_stream random{options.seed, static_cast<std::uint64_t>(step) * 0x100000000u +
                                                     static_cast<std::uint64_t>(i)};
    const double sigma = options.noise * nearest.distance * nearest.distance / 4;
    const double measured = nearest.distance + sigma * random.normal();
    frame.depth(u, v) = measured > 0 && measured < options.longest_range
                            ? static_cast<std::uint16_t>(measured * 1000 + 0.5)
                            : std::uint16_t{0};
  });
  return frame;
}
