// SPDX-License-Identifier: MIT
module cilantro.geometry;

namespace cilantro {
namespace {

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
image<std::int32_t> closed_project(points_view<S, 3> points, const pinhole_camera<S>& camera,
                                   const projection_options& options) {
  expect_valid(camera, "project");
  expect_between(0, options.point_size, std::numeric_limits<double>::max(), "project: point_size");
  image<std::int32_t> seen(camera.width, camera.height, -1);
  image<S> nearest(camera.width, camera.height, std::numeric_limits<S>::infinity());
  const projector<S> footprint_of{camera, options.point_size};
  const execution how{options.threads, options.monitor};
  std::vector<footprint<S>> footprints(points.size());
  parallel_for(points.size(), how, [&](index_t i) { footprints[i] = footprint_of(points[i]); });
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

#define CILANTRO_INSTANTIATE(S)                                                            \
  template image<std::int32_t> closed_project(points_view<S, 3>, const pinhole_camera<S>&, \
                                              const projection_options&);                  \
  template image<S> closed_depth_of(points_view<S, 3>, const image<std::int32_t>&,         \
                                    const pinhole_camera<S>&);
CILANTRO_INSTANTIATE(float)
CILANTRO_INSTANTIATE(double)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
