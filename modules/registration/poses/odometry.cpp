// SPDX-License-Identifier: MIT
module;
#include <ostream>
module cilantro.registration;

import :information;
import :local_map;
import :twists;

namespace cilantro {

std::string_view to_string(odometry_status status) {
  switch (status) {
    case odometry_status::first:
      return "first";
    case odometry_status::tracked:
      return "tracked";
    case odometry_status::degenerate:
      return "degenerate";
    case odometry_status::lost:
      return "lost";
  }
  return "?";
}

std::ostream& operator<<(std::ostream& out, odometry_status status) {
  return out << to_string(status);
}

namespace {

/// Checks the options, and fills in those that are left to the library.
odometry_options complete(odometry_options options) {
  expects(std::isfinite(options.voxel) && options.voxel > 0,
          "odometry: .voxel must be positive; a hundredth of the range of the sensor is a start");
  constexpr double most = std::numeric_limits<double>::max();
  expect_between(0, options.frame_voxel, most, "odometry: frame_voxel");
  expect_between(0, options.max_distance, most, "odometry: max_distance");
  expect_between(0, options.map_radius, most, "odometry: map_radius");
  expect_between(0, options.min_overlap, 1, "odometry: min_overlap");
  expect_between(0, options.new_overlap, 1, "odometry: new_overlap");
  expect_from(0, options.new_voxels, "odometry: new_voxels");
  expect_from(0, options.new_degrees, "odometry: new_degrees");
  expect_from(0, options.max_iterations, "odometry: max_iterations");
  expect_from(0, options.threads, "odometry: threads");
  if (options.frame_voxel == 0) options.frame_voxel = 1.5 * options.voxel;
  if (options.max_distance == 0) options.max_distance = 10 * options.voxel;
  return options;
}

/// How far one pose is from another: an angle and a length.
template <class Pose>
std::pair<double, double> change_between(const Pose& a, const Pose& b) {
  const Pose change = a.inverse() * b;
  return {rotation_angle(change.linear()), change.translation().norm()};
}

}  // namespace

template <Scalar S, int D>
struct odometry_state {
  using pose = rigid_transform<double, D>;

  odometry_options options;
  local_map<S, D> map{options};
  pose last = pose::Identity();  ///< Of the latest frame, predicted if it was lost.
  pose last_tracked = pose::Identity();
  pose last_in_map = pose::Identity();
  pose motion = pose::Identity();        ///< Between the last two frames, if it is known.
  bool was_lost = false;                 ///< Whether the latest frame was.
  double reach = 0;                      ///< Of the farthest point of any frame.
  std::optional<double> deviation = {};  ///< Mean square, of frames from their prediction.

  explicit odometry_state(odometry_options o) : options{complete(std::move(o))} {
    if (options.initial)
      last = options.initial->as<pose>(D, "odometry: .initial is of another dimension");
    expects(is_rigid<D>(last), "odometry: .initial must be a rotation and a translation");
    last = last_tracked = normalized<D>(last);
  }

  odometry_frame<D> add(const point_cloud<S, D>& frame);

 private:
  /// Within which points are paired if the next frame is as far from its prediction as others were.
  [[nodiscard]] double pairing_distance() const {
    if (!deviation) return options.max_distance;
    return std::clamp(3 * std::sqrt(*deviation), map.nearby(), options.max_distance);
  }
  void insert(const point_cloud<S, D>& frame, const pose& p) {
    map.insert(p, frame, options.map_radius > 0 ? options.map_radius : 1.5 * reach);
    last_in_map = p;
  }
};

template <Scalar S, int D>
odometry_frame<D> odometry_state<S, D>::add(const point_cloud<S, D>& frame) {
  expects(!frame.has_origin(), "odometry: frames must be in the coordinates of the sensor");
  expects(map.fits(frame),
          "odometry: either all frames have normals, or none; and so it is with colors");
  const auto& stop = options.monitor.stop;
  if (stop.stop_requested()) throw cancelled{};
  point_cloud<S, D> seen{.points = frame.points, .normals = frame.normals, .colors = frame.colors};
  if (options.map_radius > 0) {
    const point_vector<double, D> sensor = point_vector<double, D>::Zero();
    seen = crop(std::move(seen), ball{coordinates{sensor}, options.map_radius});
  }
  const auto thinned = voxel_downsample(seen, options.frame_voxel,
                                        {.threads = options.threads, .monitor = {{}, stop}});
  const pose predicted = last * motion;
  odometry_frame<D> result{.pose = predicted};
  const auto lose = [&] {
    last = predicted;
    motion = pose::Identity();
    result.status = odometry_status::lost;
    was_lost = true;
    return result;
  };
  if (thinned.empty()) return lose();
  const double farthest =
      std::max(reach, std::sqrt(double(thinned.points.colwise().squaredNorm().maxCoeff())));
  if (!map.has_begun()) {
    reach = farthest;
    insert(seen, predicted);
    result.is_in_map = true;
    return result;
  }

  const auto is_found = [&](const auto& found) {
    if (found.status == icp_status::cancelled) throw cancelled{};
    return found.status != icp_status::too_few_pairs && found.overlap >= options.min_overlap;
  };
  result.max_distance = pairing_distance();
  auto found = map.align_from(predicted, thinned, result.max_distance);
  if (!is_found(found) && result.max_distance < options.max_distance) {
    result.max_distance = options.max_distance;
    found = map.align_from(predicted, thinned, result.max_distance);
  }
  if (!is_found(found)) {
    result.max_distance = options.max_distance;
    found = map.align_from(last_tracked, thinned, result.max_distance);
  }
  const bool was_found = is_found(found);
  result.fit = std::move(static_cast<alignment_fit&>(found));
  if (!was_found) return lose();

  result.pose = map.in_the_world(found.transform);
  result.status = found.status == icp_status::degenerate ? odometry_status::degenerate
                                                         : odometry_status::tracked;
  const auto [turned, moved] = change_between(predicted, result.pose);
  const double away = 2 * farthest * std::sin(turned / 2) + moved;
  deviation = deviation ? 0.9 * *deviation + 0.1 * away * away : away * away;
  reach = farthest;
  motion = std::exchange(was_lost, false) ? pose::Identity() : last.inverse() * result.pose;
  last = last_tracked = result.pose;
  const auto [turned_since, moved_since] = change_between(last_in_map, result.pose);
  result.is_in_map = result.status == odometry_status::tracked &&
                     (result.fit.overlap < options.new_overlap ||
                      moved_since >= options.new_voxels * options.voxel ||
                      turned_since * 180 / std::numbers::pi >= options.new_degrees);
  if (result.is_in_map) insert(seen, result.pose);
  return result;
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
odometry_tracker<S, D>::odometry_tracker(odometry_options options)
    : state_{std::make_unique<odometry_state<S, D>>(std::move(options))} {}
template <Scalar S, int D>
  requires(D == 2 || D == 3)
odometry_tracker<S, D>::odometry_tracker(odometry_tracker&&) noexcept = default;
template <Scalar S, int D>
  requires(D == 2 || D == 3)
odometry_tracker<S, D>& odometry_tracker<S, D>::operator=(odometry_tracker&&) noexcept = default;
template <Scalar S, int D>
  requires(D == 2 || D == 3)
odometry_tracker<S, D>::~odometry_tracker() = default;
template <Scalar S, int D>
  requires(D == 2 || D == 3)
odometry_frame<D> odometry_tracker<S, D>::add(const point_cloud<S, D>& frame) {
  return state_->add(frame);
}
template <Scalar S, int D>
  requires(D == 2 || D == 3)
const point_cloud<S, D>& odometry_tracker<S, D>::map() const {
  return state_->map.cloud();
}

template class odometry_tracker<float, 2>;
template class odometry_tracker<float, 3>;
template class odometry_tracker<double, 2>;
template class odometry_tracker<double, 3>;

}  // namespace cilantro
