// SPDX-License-Identifier: MIT
//
// Which pixels points, lines and triangles cover, and at what depth. Internal.
module;
#include "visualization/kernels/splats.hpp"
module cilantro.visualization:rasterize;

import cilantro.standard;
import cilantro.core;
import cilantro.eigen;
import :canvas;
import :projector;

namespace cilantro {

/// The pixels from `first` to `last` of a row.
struct pixel_span {
  int first, last;

  /// Those whose middles are between two places, of pixels 0 to `size` − 1.
  static pixel_span between(double low, double high, int size) {
    return {static_cast<int>(std::ceil(std::clamp(low, -1.0, double(size)))),
            static_cast<int>(std::floor(std::clamp(high, -1.0, double(size))))};
  }
  [[nodiscard]] pixel_span within(int size) const {
    return {std::max(first, 0), std::min(last, size - 1)};
  }
};

/// As those of the C library, which are calls: of numbers that an int can hold.
inline int floor_of(float x) {
  const int whole = static_cast<int>(x);
  return whole - static_cast<int>(float(whole) > x);
}
inline int ceil_of(float x) {
  const int whole = static_cast<int>(x);
  return whole + static_cast<int>(float(whole) < x);
}

/// A splat in the picture: its middle and radius in pixels, and its depth and diameter.
struct splat {
  float x, y, radius, z, diameter;
};

/// One of `stride` points, of those from `stride * block` on: with a fixed step, the rows of scans
/// would make patterns.
inline index_t sampled(index_t block, index_t stride) {
  const std::uint64_t scattered = static_cast<std::uint64_t>(block) * 0x9e3779b97f4a7c15u >> 32;
  return block * stride + static_cast<index_t>(scattered % static_cast<std::uint64_t>(stride));
}

/// Calls `f(i, splat)` for one of `stride` points each, if it may be seen: those of the blocks from
/// `begin` to `end`.
template <class F>
void for_splats(const point_batch& batch, const projector& by, index_t stride, index_t begin,
                index_t end, F&& f) {
  const batch_placement place{by, batch.origin};
  const bool is_length = batch.size.in == point_size::unit::length;
  const auto& sizes = batch.size.sizes;
  const float fx = float(by.fx), fy = float(by.fy), cx = float(by.cx), cy = float(by.cy);
  const float nearest = float(by.nearest), fineness = float(by.fineness);
  const bool orthographic = by.orthographic;
  // A radius. Larger ones would only be something that is too near.
  const float largest = 512 * fineness;
  // Fewer points of a surface are further apart.
  const float growth = is_length ? std::sqrt(float(stride)) : 1;
  const float width = float(by.width) - 0.5f, height = float(by.height) - 0.5f;
  const Eigen::Matrix3f turn = place.linear;
  const Eigen::Vector3f offset = place.offset;

  // In arrays, so that the compiler does several at once.
  constexpr index_t most = 256;
  std::array<float, most> x, y, z, size, radius, diameter;
  for (; begin < end; begin += most) {
    const auto n = static_cast<std::size_t>(std::min(most, end - begin));
    const auto number = [&](std::size_t k) {
      const index_t block = begin + static_cast<index_t>(k);
      return stride == 1 ? block : std::min(sampled(block, stride), batch.points.cols() - 1);
    };
    for (std::size_t k = 0; k < n; ++k) {
      const float* const p = batch.points.data() + 3 * number(k);
      x[k] = p[0];
      y[k] = p[1];
      z[k] = p[2];
    }
    for (std::size_t k = 0; k < n; ++k) size[k] = growth * sizes[sizes.size() == 1 ? 0 : number(k)];
    for (std::size_t k = 0; k < n; ++k) {
      const float u = turn(0, 0) * x[k] + turn(0, 1) * y[k] + turn(0, 2) * z[k] + offset[0];
      const float v = turn(1, 0) * x[k] + turn(1, 1) * y[k] + turn(1, 2) * z[k] + offset[1];
      const float w = turn(2, 0) * x[k] + turn(2, 1) * y[k] + turn(2, 2) * z[k] + offset[2];
      const float scale = orthographic ? 1 : 1 / w;
      const float pixels = is_length ? size[k] * fx * scale : size[k] * fineness;
      diameter[k] = is_length ? size[k] : pixels / (fx * scale);
      // What is smaller than a pixel is a pixel.
      radius[k] = std::max(std::min(pixels / 2, largest), 0.5f);
      x[k] = fx * u * scale + cx;
      y[k] = fy * v * scale + cy;
      z[k] = w;
    }
    for (std::size_t k = 0; k < n; ++k) {
      const splat s{x[k], y[k], radius[k], z[k], diameter[k]};
      const bool is_seen = s.z > nearest && s.z <= std::numeric_limits<float>::max() &&
                           s.x + s.radius >= -0.5f && s.y + s.radius >= -0.5f &&
                           s.x - s.radius < width && s.y - s.radius < height;
      if (is_seen) f(number(k), s);
    }
  }
}

/// The rows that a splat covers.
inline int first_row(const splat& s) {
  return std::max(ceil_of(s.y - s.radius), 0);
}
inline int last_row(const splat& s, const projector& by) {
  return std::min(floor_of(s.y + s.radius), by.height - 1);
}

/// The square of nine pixels around a splat that is at most that large.
struct nine_pixels {
  index_t first;  ///< The pixel at the top left.
  /// Of the middles of the pixels, row by row: the squared distance from that of the splat, as a
  /// share of the squared radius. Beyond 1 it is not covered.
  std::array<float, 9> shares;

  /// Whether a splat is so small.
  static inline bool suffice(const splat& s) { return s.radius < 1.5f; }
  /// Whether all of the splat is in such a square, all of which is in the picture.
  static inline bool hold(const splat& s, const projector& by) {
    return s.radius >= 0.71f && suffice(s) && s.x >= 1.5f && s.y >= 1.5f &&
           s.x < float(by.width) - 3 && s.y < float(by.height) - 3;
  }
  inline nine_pixels(const splat& s, const projector& by) {
    const int x = ceil_of(s.x - s.radius), y = ceil_of(s.y - s.radius);
    first = index_t(y) * by.width + x;
    const float dx = float(x) - s.x, dy = float(y) - s.y, inverse = 1 / (s.radius * s.radius);
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column) {
        const float u = dx + float(column), v = dy + float(row);
        shares[3 * row + column] = (u * u + v * v) * inverse;
      }
  }
};

/// Calls `f(pixel, share)` for each pixel of a splat: its number, and its share as above. For small
/// ones, without a branch for each: `f` is called for all nine, and has to ignore shares beyond 1.
template <class F>
void for_pixels(const splat& s, const projector& by, F&& f) {
  if (s.radius < 0.71f) {
    const int x = floor_of(s.x + 0.5f), y = floor_of(s.y + 0.5f);
    if (0 <= x && x < by.width && 0 <= y && y < by.height) f(index_t(y) * by.width + x, 0.0f);
    return;
  }
  if (nine_pixels::hold(s, by)) {
    const nine_pixels nine{s, by};
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column)
        f(nine.first + row * by.width + column, nine.shares[3 * row + column]);
    return;
  }
  const float square = s.radius * s.radius, inverse = 1 / square;
  const int y_end = last_row(s, by);
  for (int y = first_row(s); y <= y_end; ++y) {
    const float dy = float(y) - s.y, half = std::sqrt(std::max(square - dy * dy, 0.0f));
    const int x_begin = std::max(ceil_of(s.x - half), 0);
    const int x_end = std::min(floor_of(s.x + half), by.width - 1);
    const index_t row = index_t(y) * by.width;
    for (int x = x_begin; x <= x_end; ++x) {
      const float dx = float(x) - s.x;
      f(row + x, std::min((dx * dx + dy * dy) * inverse, 1.0f));
    }
  }
}

/// What covers pixels by the vector instructions at hand.
inline detail::splat_kernels splat_kernels_here() {
  return detail::for_target(static_cast<int>(current_vector_target()),
                            []<detail::kernel_target V> { return detail::splat_kernels_in<V>(); });
}
inline detail::pixel_grid grid_of(const projector& by) {
  return {float(by.fx),    float(by.fy), float(by.cx), float(by.cy),
          by.orthographic, by.width,     by.height};
}

inline detail::round_splat round_of(const splat& s, const projector& by) {
  return {s.x, s.y, s.radius, first_row(s), last_row(s, by)};
}

/// Calls `f(pixel, share, z)` for each pixel of a splat that is a disc across a normal, or the one
/// pixel of one that is seen from the side: with the squared distance in its plane as a share of
/// the squared radius, and the depth there. Precondition: the normal is finite and not zero.
template <class F>
void for_pixels(const splat& s, const Eigen::Vector3f& normal, const detail::pixel_grid& grid,
                detail::cover_by_disc* cover, F&& f) {
  const float scale = grid.orthographic ? 1 : s.z;
  const Eigen::Vector3f middle{(s.x - grid.cx) / grid.fx * scale, (s.y - grid.cy) / grid.fy * scale,
                               s.z};
  const detail::disc_shape disc{s.x,
                                s.y,
                                {normal.x(), normal.y(), normal.z()},
                                {middle.x(), middle.y(), middle.z()},
                                normal.dot(middle),
                                s.diameter * s.diameter / 4};
  // Near the border of a picture, the picture of a disc is longer than that of one in its middle.
  const float reach = 1.25f * s.radius;
  const int x_begin = std::max(ceil_of(s.x - reach), 0);
  const int y_begin = std::max(ceil_of(s.y - reach), 0);
  const int x_end = std::min(floor_of(s.x + reach), grid.width - 1);
  const int y_end = std::min(floor_of(s.y + reach), grid.height - 1);
  const int size = x_end - x_begin, shift = size < 4 ? 2 : size < 8 ? 3 : 4, columns = 1 << shift;
  detail::covered_block found;
  for (int y = y_begin; y <= y_end; y += 16 >> shift)
    for (int x = x_begin; x <= x_end; x += columns) {
      unsigned covered = cover(disc, grid, {columns, x, y, x_end, y_end}, found);
      for (; covered != 0; covered &= covered - 1) {
        const int i = std::countr_zero(covered);
        f(index_t(y + (i >> shift)) * grid.width + x + (i & (columns - 1)), found.shares[i],
          found.depths[i]);
      }
    }
}

/// Lines are drawn nearer by this, so that they are seen on a surface.
constexpr double line_lift = 1 - 1e-3;

/// Where the way from a place that is seen to one that is not has the depth `near`.
inline Eigen::Vector3d where_nearest(const Eigen::Vector3d& seen, const Eigen::Vector3d& unseen,
                                     double near) {
  Eigen::Vector3d p = seen + (seen.z() - near) / (seen.z() - unseen.z()) * (unseen - seen);
  p.z() = near;
  return p;
}

/// Calls `f(segment, pixel, z)` for each pixel of each line of a batch.
template <class F>
void rasterize(const line_batch& batch, const projector& by, const execution& how, F&& f) {
  const batch_placement place{by, batch.origin};
  parallel_for(batch.segments.cols(), how, [&](index_t i) {
    Eigen::Vector3d a = place(batch.points.col(batch.segments(0, i))).cast<double>(),
                    b = place(batch.points.col(batch.segments(1, i))).cast<double>();
    if (!is_finite(a) || !is_finite(b)) return;
    const double near = std::max(by.nearest, 1e-12);
    if (a.z() < near && b.z() < near) return;
    if (a.z() < near) a = where_nearest(b, a, near);
    if (b.z() < near) b = where_nearest(a, b, near);
    const auto from = by.seen(a), to = by.seen(b);
    const double dx = to.x - from.x, dy = to.y - from.y;
    const bool is_steep = std::abs(dy) > std::abs(dx);
    const double along = is_steep ? dy : dx, aside = is_steep ? dx : dy;
    const double begin = is_steep ? from.y : from.x, middle = is_steep ? from.x : from.y;
    const int along_size = is_steep ? by.height : by.width;
    const int aside_size = is_steep ? by.width : by.height;
    const double half = batch.width * by.fineness / 2 *
                        (along == 0 ? 1 : std::hypot(along, aside) / std::abs(along));
    const auto steps = pixel_span::between(std::min(begin, begin + along) - 0.5,
                                           std::max(begin, begin + along) + 0.5, along_size)
                           .within(along_size);
    for (int step = steps.first; step <= steps.last; ++step) {
      const double t = along == 0 ? 0 : std::clamp((step - begin) / along, 0.0, 1.0);
      const double z =
          line_lift * (by.orthographic ? from.z + t * (to.z - from.z)
                                       : 1 / (1 / from.z + t * (1 / to.z - 1 / from.z)));
      const double center = middle + t * aside;
      auto across = pixel_span::between(center - half, center + half, aside_size);
      if (across.first > across.last) across.first = across.last = int(std::floor(center + 0.5));
      across = across.within(aside_size);
      for (int c = across.first; c <= across.last; ++c) {
        const int x = is_steep ? c : step, y = is_steep ? step : c;
        f(i, index_t(y) * by.width + x, float(z));
      }
    }
  });
}

/// The part of a triangle beyond a depth: up to four corners.
struct clipped_triangle {
  std::array<Eigen::Vector3d, 4> corners;
  int count = 0;

  clipped_triangle(const std::array<Eigen::Vector3d, 3>& all, double near) {
    for (int i = 0; i < 3; ++i) {
      const auto &a = all[i], &b = all[(i + 1) % 3];
      if (a.z() >= near) corners[count++] = a;
      if ((a.z() < near) != (b.z() < near))
        corners[count++] = a.z() < near ? where_nearest(b, a, near) : where_nearest(a, b, near);
    }
  }
};

/// Calls `f(triangle, pixel, z)` for each pixel whose middle is in a triangle of a batch; one that
/// is on the edge between two belongs to one of them.
template <class F>
void rasterize(const triangle_batch& batch, const projector& by, const execution& how, F&& f) {
  const batch_placement place{by, batch.origin};
  parallel_for(batch.triangles.cols(), how, [&](index_t i) {
    std::array<Eigen::Vector3d, 3> all;
    for (int k = 0; k < 3; ++k) {
      all[k] = place(batch.points.col(batch.triangles(k, i))).template cast<double>();
      if (!is_finite(all[k])) return;
    }
    const clipped_triangle part{all, std::max(by.nearest, 1e-12)};
    for (int corner = 2; corner < part.count; ++corner) {
      std::array<projector::place, 3> p{by.seen(part.corners[0]), by.seen(part.corners[corner - 1]),
                                        by.seen(part.corners[corner])};
      double area = (p[1].x - p[0].x) * (p[2].y - p[0].y) - (p[2].x - p[0].x) * (p[1].y - p[0].y);
      if (!(std::abs(area) > 0) || !std::isfinite(area)) continue;
      if (area < 0) {
        std::swap(p[1], p[2]);
        area = -area;
      }
      const auto rows = pixel_span::between(std::min({p[0].y, p[1].y, p[2].y}),
                                            std::max({p[0].y, p[1].y, p[2].y}), by.height)
                            .within(by.height);
      const auto columns = pixel_span::between(std::min({p[0].x, p[1].x, p[2].x}),
                                               std::max({p[0].x, p[1].x, p[2].x}), by.width)
                               .within(by.width);
      const auto depth = [&](int k) { return by.orthographic ? p[k].z : 1 / p[k].z; };
      for (int y = rows.first; y <= rows.last; ++y)
        for (int x = columns.first; x <= columns.last; ++x) {
          std::array<double, 3> weights;
          bool is_inside = true;
          for (int k = 0; k < 3; ++k) {
            const auto &a = p[(k + 1) % 3], &b = p[(k + 2) % 3];
            const double dx = b.x - a.x, dy = b.y - a.y;
            weights[k] = dx * (y - a.y) - dy * (x - a.x);
            const bool owns_edge = dy < 0 || (dy == 0 && dx > 0);
            is_inside &= weights[k] > 0 || (weights[k] == 0 && owns_edge);
          }
          if (!is_inside) continue;
          const double mixed =
              (weights[0] * depth(0) + weights[1] * depth(1) + weights[2] * depth(2)) / area;
          f(i, index_t(y) * by.width + x, float(by.orthographic ? mixed : 1 / mixed));
        }
    }
  });
}

}  // namespace cilantro
