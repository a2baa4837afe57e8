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

/// Rows handed to a thread at a time.
constexpr index_t rows_at_a_time = 16;

template <Scalar S>
void expect_valid(const pinhole_camera<S>& camera, const char* who) {
  expects(camera.fx > 0 && camera.fy > 0 && std::isfinite(camera.fx) && std::isfinite(camera.fy),
          std::string{who} + ": the focal lengths must be positive");
}

template <Scalar S>
void expect_size(const image<S>& depth, const pinhole_camera<S>& camera) {
  expect_valid(camera, "unproject");
  expects(depth.width() == camera.width && depth.height() == camera.height,
          "unproject: image and camera must have the same size");
}

/// The point in the world that a pixel of some depth shows.
template <Scalar S>
class ray_caster {
 public:
  explicit ray_caster(const pinhole_camera<S>& camera)
      : camera_{camera},
        rotation_{camera.to_world.linear()},
        position_{camera.to_world.translation()} {}

  [[nodiscard]] point_vector<S, 3> operator()(int u, int v, S z) const {
    const point_vector<S, 3> seen{(S(u) - camera_.cx) / camera_.fx * z,
                                  (S(v) - camera_.cy) / camera_.fy * z, z};
    return rotation_ * seen + position_;
  }

 private:
  const pinhole_camera<S>& camera_;
  Eigen::Matrix<S, 3, 3> rotation_;
  point_vector<S, 3> position_;
};

/// The pixels that a point covers, and how far away it is. Empty if it is not seen.
template <Scalar S>
struct footprint {
  std::int32_t left = 0, right = -1, top = 0, bottom = -1;
  S depth = 0;
};

template <Scalar S>
class projector {
 public:
  projector(const pinhole_camera<S>& camera, double point_size)
      : camera_{camera},
        half_size_{static_cast<S>(point_size) / 2},
        rotation_{camera.to_world.inverse().linear()},
        origin_{camera.to_world.inverse().translation()} {}

  [[nodiscard]] S depth(const auto& point) const { return (rotation_ * point + origin_).z(); }

  [[nodiscard]] footprint<S> operator()(const auto& point) const {
    const point_vector<S, 3> p = rotation_ * point + origin_;
    if (!(p.z() > 0)) return {};
    const S half = half_size_ / p.z();
    const S u = camera_.fx * p.x() / p.z() + camera_.cx + S(0.5);
    const S v = camera_.fy * p.y() / p.z() + camera_.cy + S(0.5);
    const auto [left, right] = covered(std::floor(u - camera_.fx * half),
                                       std::floor(u + camera_.fx * half), camera_.width);
    const auto [top, bottom] = covered(std::floor(v - camera_.fy * half),
                                       std::floor(v + camera_.fy * half), camera_.height);
    if (right < left) return {};
    return {left, right, top, bottom, p.z()};
  }

 private:
  /// The pixels from `low` to `high` that are in the image. A comparison with NaN leaves none.
  static std::pair<std::int32_t, std::int32_t> covered(S low, S high, int size) {
    if (!(high >= 0 && low < S(size))) return {0, -1};
    return {static_cast<std::int32_t>(std::max(low, S(0))),
            static_cast<std::int32_t>(std::min(high, S(size - 1)))};
  }

  const pinhole_camera<S>& camera_;
  S half_size_;
  Eigen::Matrix<S, 3, 3> rotation_;
  point_vector<S, 3> origin_;
};

}  // namespace

template <Scalar S>
point_matrix<S, 3> closed_unproject(const image<S>& depth, const pinhole_camera<S>& camera,
                                    const execution& how) {
  expect_size(depth, camera);
  const ray_caster<S> point_at{camera};
  point_matrix<S, 3> points(3, std::ssize(depth.pixels()));
  parallel_blocks(depth.height(), rows_at_a_time, how, [&](index_t, index_t begin, index_t end) {
    index_t i = begin * depth.width();
    for (int v = static_cast<int>(begin); v < static_cast<int>(end); ++v)
      for (int u = 0; u < depth.width(); ++u, ++i) {
        const S z = depth(u, v);
        if (z > 0)
          points.col(i) = point_at(u, v, z);
        else
          points.col(i).setConstant(std::numeric_limits<S>::quiet_NaN());
      }
  });
  return points;
}

template <Scalar S>
point_matrix<S, 3> unproject_known(const image<S>& depth, const pinhole_camera<S>& camera,
                                   const execution& how) {
  expect_size(depth, camera);
  const ray_caster<S> point_at{camera};
  // Where the points of each row begin: counting is cheap, and a thread then writes only its own.
  std::vector<index_t> first(static_cast<std::size_t>(depth.height()) + 1);
  for (int v = 0; v < depth.height(); ++v) {
    index_t count = 0;
    for (int u = 0; u < depth.width(); ++u) count += depth(u, v) > 0;
    first[static_cast<std::size_t>(v) + 1] = first[static_cast<std::size_t>(v)] + count;
  }
  point_matrix<S, 3> points(3, first.back());
  parallel_blocks(depth.height(), rows_at_a_time, how, [&](index_t, index_t begin, index_t end) {
    index_t i = first[static_cast<std::size_t>(begin)];
    for (int v = static_cast<int>(begin); v < static_cast<int>(end); ++v)
      for (int u = 0; u < depth.width(); ++u)
        if (const S z = depth(u, v); z > 0) points.col(i++) = point_at(u, v, z);
  });
  return points;
}

template <Scalar S>
point_matrix<S, 3> organized_normals(const point_matrix<S, 3>& points,
                                     const pinhole_camera<S>& camera, const execution& how) {
  expects(camera.width >= 0 && camera.height >= 0 &&
              points.cols() == index_t{camera.width} * camera.height,
          "organized_normals: there must be one point a pixel");
  point_matrix<S, 3> normals = point_matrix<S, 3>::Zero(3, points.cols());
  const index_t w = camera.width, h = camera.height;
  const point_vector<S, 3> eye = camera.to_world.translation();
  parallel_blocks(h, rows_at_a_time, how, [&](index_t, index_t begin, index_t end) {
    for (index_t y = std::max<index_t>(begin, 1); y < std::min(end, h - 1); ++y)
      for (index_t i = y * w + 1; i < (y + 1) * w - 1; ++i) {
        const point_vector<S, 3> across = points.col(i + 1) - points.col(i - 1);
        const point_vector<S, 3> down = points.col(i + w) - points.col(i - w);
        const point_vector<S, 3> normal = across.cross(down);
        const S length = normal.norm();
        // NaN in any of the five, and neighbours on a line, fail this.
        if (!(length > 0 && std::isfinite(length)) || !is_finite(points.col(i))) continue;
        const S side = normal.dot(eye - points.col(i)) < 0 ? -1 : 1;
        normals.col(i) = normal * (side / length);
      }
  });
  return normals;
}

template <Scalar S>
image<std::int32_t> closed_project(points_view<S, 3> points, const pinhole_camera<S>& camera,
                                   const projection_options& options) {
  expect_valid(camera, "project");
  expect_between(0, options.point_size, std::numeric_limits<double>::max(), "project: point_size");
  image<std::int32_t> seen(camera.width, camera.height, -1);
  image<S> nearest(camera.width, camera.height, std::numeric_limits<S>::infinity());
  const projector<S> footprint_of{camera, options.point_size};
  const execution how{options.threads, options.monitor};
  std::vector<footprint<S>> footprints(static_cast<std::size_t>(points.size()));
  parallel_for(points.size(), how, [&](index_t i) {
    footprints[static_cast<std::size_t>(i)] = footprint_of(points[i]);
  });
  // Each band of rows is one thread's own, and meets the points in their order: no race, no tie.
  const int bands = std::min(8, std::max(camera.height, 1));
  parallel_blocks(bands, 1, {.threads = options.threads}, [&](index_t band, index_t, index_t) {
    const auto first = static_cast<int>(band * camera.height / bands);
    const auto last = static_cast<int>((band + 1) * camera.height / bands) - 1;
    for (std::size_t i = 0; i < footprints.size(); ++i) {
      const auto& f = footprints[i];
      for (int y = std::max(f.top, first); y <= std::min(f.bottom, last); ++y)
        for (int x = f.left; x <= f.right; ++x)
          if (f.depth < nearest(x, y)) {
            nearest(x, y) = f.depth;
            seen(x, y) = static_cast<std::int32_t>(i);
          }
    }
  });
  return seen;
}

template <Scalar S>
image<S> closed_depth_of(points_view<S, 3> points, const image<std::int32_t>& seen,
                         const pinhole_camera<S>& camera) {
  const projector<S> project{camera, 0};
  return paint(seen, [&](index_t i) { return project.depth(points[i]); });
}

template <Scalar S>
image<std::uint16_t> quantize_depth(const image<S>& depth, positive units_per_metre) {
  image<std::uint16_t> stored(depth.width(), depth.height());
  for (std::size_t i = 0; i < stored.pixels().size(); ++i) {
    const double units = std::floor(double(depth.pixels()[i]) * double(units_per_metre) + 0.5);
    if (units > 0 && units < std::numeric_limits<std::uint16_t>::max())
      stored.pixels()[i] = static_cast<std::uint16_t>(units);
  }
  return stored;
}

#define CILANTRO_INSTANTIATE(S)                                                              \
  template point_matrix<S, 3> closed_unproject(const image<S>&, const pinhole_camera<S>&,    \
                                               const execution&);                            \
  template point_matrix<S, 3> unproject_known(const image<S>&, const pinhole_camera<S>&,     \
                                              const execution&);                             \
  template point_matrix<S, 3> organized_normals(const point_matrix<S, 3>&,                   \
                                                const pinhole_camera<S>&, const execution&); \
  template image<std::int32_t> closed_project(points_view<S, 3>, const pinhole_camera<S>&,   \
                                              const projection_options&);                    \
  template image<S> closed_depth_of(points_view<S, 3>, const image<std::int32_t>&,           \
                                    const pinhole_camera<S>&);                               \
  template image<std::uint16_t> quantize_depth(const image<S>&, positive);
CILANTRO_INSTANTIATE(float)
CILANTRO_INSTANTIATE(double)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
