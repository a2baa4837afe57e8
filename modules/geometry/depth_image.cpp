// SPDX-License-Identifier: MIT
module cilantro.geometry;

namespace cilantro {
namespace {

/// Rows handed to a thread at a time.
constexpr index_t rows_at_a_time = 16;

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
  const auto is_known = [](S z) { return z > 0 && z <= std::numeric_limits<S>::max(); };
  // Where the points of each row begin: counting is cheap, and a thread then writes only its own.
  std::vector<index_t> first(static_cast<std::size_t>(depth.height()) + 1);
  for (int v = 0; v < depth.height(); ++v) {
    index_t count = 0;
    for (int u = 0; u < depth.width(); ++u) count += is_known(depth(u, v));
    first[static_cast<std::size_t>(v) + 1] = first[v] + count;
  }
  point_matrix<S, 3> points(3, first.back());
  parallel_blocks(depth.height(), rows_at_a_time, how, [&](index_t, index_t begin, index_t end) {
    index_t i = first[begin];
    for (int v = static_cast<int>(begin); v < static_cast<int>(end); ++v)
      for (int u = 0; u < depth.width(); ++u)
        if (const S z = depth(u, v); is_known(z)) points.col(i++) = point_at(u, v, z);
  });
  return points;
}

template <Scalar S>
point_matrix<S, 3> organized_normals(const point_matrix<S, 3>& points,
                                     const pinhole_camera<S>& camera, const execution& how) {
  expects(camera.width >= 0 && camera.height >= 0 &&
              points.cols() == index_t{camera.width} * camera.height,
          "organized_normals: there must be one point per pixel");
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
  template image<std::uint16_t> quantize_depth(const image<S>&, positive);
CILANTRO_INSTANTIATE(float)
CILANTRO_INSTANTIATE(double)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
