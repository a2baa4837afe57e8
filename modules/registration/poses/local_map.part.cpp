// SPDX-License-Identifier: MIT
//
// What an odometry has seen around the sensor, and how a frame lies in it.
module cilantro.registration:local_map;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.geometry;
import cilantro.cloud;
import :align;
import :odometry;

namespace cilantro {

template <Scalar S, int D>
class local_map {
 public:
  using pose = rigid_transform<double, D>;

  explicit local_map(const odometry_options& options) : options_{options} {}

  [[nodiscard]] const point_cloud<S, D>& cloud() const { return cloud_; }
  /// Whether a frame has been inserted.
  [[nodiscard]] bool has_begun() const { return has_begun_; }

  /// Whether the frame has the same data as those before it.
  [[nodiscard]] bool fits(const point_cloud<S, D>& frame) const {
    return !has_begun_ || frame.empty() ||
           (frame.has_normals() == has_own_normals_ && frame.has_colors() == has_colors_);
  }

  /// Within which a point counts as lying on the map.
  [[nodiscard]] double nearby() const {
    return std::min(3 * options_.voxel, options_.max_distance);
  }

  /// A transform that `align` has found, to the coordinates of the poses.
  [[nodiscard]] pose in_the_world(const rigid_transform<S, D>& found) const {
    return make_transform<pose>(
        nearest_rotation(found.linear().template cast<double>()),
        (found.translation().template cast<double>() + cloud_.origin).eval());
  }

  /// Aligns a frame to the map, with pairs within that distance at first, and nearby at last.
  [[nodiscard]] auto align_from(const pose& start, const point_cloud<S, D>& frame,
                                double max_distance) const {
    const auto within = [&](const local& initial, double distance) {
      return align(
          frame, oriented_points_view<S, D>{as_points(cloud_.points), as_points(cloud_.normals)},
          {.metric = options_.metric,
           .initial = initial,
           .max_distance = distance,
           .max_iterations = options_.max_iterations,
           .tolerance = std::min(1e-4, 1e-3 * options_.voxel),
           .normals = options_.normals,
           .robust = options_.robust ? options_.robust : robust_kernel{geman_mcclure{distance / 3}},
           .solver = options_.solver,
           .threads = options_.threads,
           .monitor = {{}, options_.monitor.stop}});
    };
    if (max_distance <= nearby()) return within(in_map(start), max_distance);
    return within(within(in_map(start), max_distance).transform, nearby());
  }

  /// Adds a frame, and drops what is farther from it than the radius. What a cell has it keeps:
  /// then the map does not follow the small errors of later frames.
  void insert(const pose& p, const point_cloud<S, D>& frame, double radius) {
    const execution how{.threads = options_.threads};
    point_cloud<S, D> before = cloud_, moved = frame;
    point_vector<double, D> origin = has_begun_ ? cloud_.full_origin() : p.translation().eval();
    cloud_.origin = origin;
    before.origin.setZero();
    if (!frame.has_normals()) before.normals.resize(D, 0);
    moved.points = transform_points(in_map(p), frame.points);
    if (frame.has_normals()) moved.normals = transform_normals(in_map(p), frame.normals);
    const point_vector<double, D> place = p.translation() - origin;
    auto all = crop(append(before, moved), ball{coordinates{place}, radius});
    if (place.norm() > radius) {
      // Small coordinates are rounded little.
      const point_vector<S, D>& shift = place.template cast<S>();
      all.points.colwise() -= shift;
      origin += shift.template cast<double>();
    }
    auto next = voxel_downsample(all, options_.voxel,
                                 {.origin = coordinates{(-origin).eval()},
                                  .pick = voxel_representative::first,
                                  .threads = how.threads});
    if (!frame.has_normals())
      next.normals =
          estimate_normals(next.points, options_.normals, {.threads = how.threads}).normals;
    next.origin = origin;
    has_begun_ = true;
    has_own_normals_ = frame.has_normals();
    has_colors_ = frame.has_colors();
    cloud_ = std::move(next);
  }

 private:
  using local = rigid_transform<S, D>;

  /// To the coordinates of the map's points.
  [[nodiscard]] local in_map(const pose& p) const {
    return make_transform<local>(p.linear(), (p.translation() - cloud_.origin).eval());
  }

  const odometry_options& options_;
  point_cloud<S, D> cloud_ = {};
  bool has_begun_ = false, has_own_normals_ = false, has_colors_ = false;
};

}  // namespace cilantro
