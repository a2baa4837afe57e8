// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <ranges>
#include <stop_token>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import registration_support;
import simulated_room;
import test_support;

using namespace cilantro;

namespace {

constexpr simulation_options small_camera{.width = 160, .height = 120, .noise = 0.001};

template <class S>
point_cloud<S, 3> room_frame(int step) {
  auto frame = simulate(step, small_camera);
  frame.camera.to_world.setIdentity();
  return cast<S>(cloud_from_depth(frame.depth, frame.camera) | remove_invalid());
}

template <class S>
std::vector<point_cloud<S, 3>> room_frames(int count) {
  std::vector<point_cloud<S, 3>> frames;
  for (int i = 0; i < count; ++i) frames.push_back(room_frame<S>(i));
  return frames;
}

/// From the coordinates of a frame of the room to those of the first.
Eigen::Isometry3d room_pose(int step) {
  return simulated_camera(0, small_camera).to_world.inverse() *
         simulated_camera(step, small_camera).to_world;
}

double angle_of(const auto& linear) {
  return std::asin(std::min(1.0, (linear - linear.transpose()).norm() / std::sqrt(8.0)));
}

/// What a laser at a place in a hall with a pillar sees, all around.
template <class S>
point_cloud<S, 2> hall_scan(const Eigen::Isometry2d& pose) {
  point_cloud<S, 2> scan{.points = Eigen::Matrix<S, 2, dynamic>(2, 720)};
  for (index_t i = 0; i < 720; ++i) {
    const double angle = double(i) * std::numbers::pi / 360;
    const Eigen::Vector2d own{std::cos(angle), std::sin(angle)};
    const Eigen::Vector2d at = pose.translation(), along = pose.linear() * own;
    double range = 1e9;
    // The walls of 10 by 6 metres, and a pillar of 1 metre at (2, 1).
    for (int axis = 0; axis < 2; ++axis) {
      const double wall = (along[axis] > 0 ? 1 : -1) * (axis == 0 ? 5 : 3);
      if (std::abs(along[axis]) > 1e-9) range = std::min(range, (wall - at[axis]) / along[axis]);
    }
    const Eigen::Vector2d from = at - Eigen::Vector2d{2, 1};
    const double half = from.dot(along), root = half * half - from.squaredNorm() + 0.25;
    if (root > 0 && -half - std::sqrt(root) > 0) range = std::min(range, -half - std::sqrt(root));
    random_stream random{7, std::uint64_t(i)};
    scan.points.col(i) = ((range + 0.002 * random.normal()) * own).template cast<S>();
  }
  return scan;
}

Eigen::Isometry2d hall_pose(int step) {
  Eigen::Isometry2d pose = Eigen::Isometry2d::Identity();
  pose.linear() = Eigen::Rotation2Dd{0.05 * step}.toRotationMatrix();
  pose.translation() << -2 + 0.08 * step, -1 + 0.3 * std::sin(0.1 * step);
  return pose;
}

void check_same(const auto& a, const auto& b) {
  REQUIRE(a.frames.size() == b.frames.size());
  for (std::size_t i = 0; i < a.frames.size(); ++i) {
    CHECK(test::same_bits(a.frames[i].pose.matrix(), b.frames[i].pose.matrix()));
    CHECK(a.frames[i].status == b.frames[i].status);
    CHECK(a.frames[i].is_in_map == b.frames[i].is_in_map);
  }
  CHECK(a.map == b.map);
}

}  // namespace

TEST_CASE_TEMPLATE("a walk around a table", S, float, double) {
  constexpr int count = 40;
  const auto frames = room_frames<S>(count);
  const auto path = frames | odometry({.voxel = 0.03});
  REQUIRE(path.frames.size() == count);
  CHECK(path.frames[0].status == odometry_status::first);
  CHECK(path.lost().empty());
  CHECK(!path.was_stopped);
  double farthest = 0, most = 0;
  index_t in_map = 0;
  for (int i = 0; i < count; ++i) {
    const auto& frame = path.frames[std::size_t(i)];
    if (i > 0) CHECK(frame.status == odometry_status::tracked);
    const Eigen::Isometry3d error = room_pose(i).inverse() * frame.pose;
    farthest = std::max(farthest, error.translation().norm());
    most = std::max(most, angle_of(error.linear()));
    in_map += frame.is_in_map;
  }
  MESSAGE("at most " << 1000 * farthest << " mm and " << 1000 * most << " mrad off, "
                     << path.map.size() << " points in the map, of " << in_map << " frames");
  CHECK(farthest < 0.015);
  CHECK(most < 0.01);
  CHECK(in_map > 3);
  CHECK(in_map < count);
  // One point a cell, each on a surface.
  CHECK(voxel_grid{path.map.points, 0.03, {.origin = coordinates{(-path.map.full_origin()).eval()}}}
            .size() == path.map.size());
  CHECK(path.map.normals.cols() == path.map.size());
}

TEST_CASE("the same bits for any number of threads, and for frames of any kind") {
  const auto frames = room_frames<double>(8);
  const auto one = frames | odometry({.voxel = 0.03, .threads = 1});
  check_same(one, frames | odometry({.voxel = 0.03, .threads = 4}));
  check_same(one, std::views::iota(0, 8) | each(room_frame<double>, {.ahead = 2}) |
                      odometry({.voxel = 0.03}));
  odometry_tracker<double, 3> tracker{{.voxel = 0.03}};
  odometry_result<double, 3> live;
  for (const auto& frame : frames) live.frames.push_back(tracker.add(frame));
  live.map = tracker.map();
  check_same(one, live);
  odometry_tracker<double, 3> sink{{.voxel = 0.03}};
  frames | accumulate_into(sink);
  CHECK(sink.map() == one.map);
  CHECK(one.poses().size() == 8);
}

TEST_CASE("normals and colors of the frames are those of the map") {
  auto frames = room_frames<float>(6);
  for (auto& frame : frames) {
    frame = estimate_normals(std::move(frame), knn{10}, {.viewpoint = {{0, 0, 0}}});
    frame.colors = Eigen::Matrix3Xf::Constant(3, frame.size(), 0.25F);
  }
  const auto path = frames | odometry({.voxel = 0.03});
  CHECK(path.lost().empty());
  CHECK(path.map.has_colors());
  // They look to where the sensor was.
  index_t turned_away = 0;
  for (index_t i = 0; i < path.map.size(); ++i)
    turned_away += path.map.normals.col(i).dot(path.map.points.col(i)) > 0.2F;
  CHECK(turned_away < path.map.size() / 50);
  auto bare = frames[0];
  bare.normals.resize(3, 0);
  odometry_tracker<float, 3> tracker{{.voxel = 0.03}};
  (void)tracker.add(frames[0]);
  CHECK_THROWS_AS(tracker.add(bare), invalid_input);
  CHECK(tracker.add(frames[1]).status == odometry_status::tracked);
}

TEST_CASE_TEMPLATE("a laser in a hall, in the plane", S, float, double) {
  odometry_tracker<S, 2> tracker{{.voxel = 0.05}};
  for (int i = 0; i < 50; ++i) {
    const auto frame = tracker.add(hall_scan<S>(hall_pose(i)));
    const Eigen::Isometry2d truth = hall_pose(0).inverse() * hall_pose(i);
    CHECK(frame.status == (i == 0 ? odometry_status::first : odometry_status::tracked));
    CHECK((frame.pose.translation() - truth.translation()).norm() < 0.03);
    CHECK(test::difference(frame.pose, truth) < 0.03);
  }
  CHECK(tracker.map().size() < 1500);
}

TEST_CASE("frames that are lost have a predicted pose and leave no trace in the map") {
  const auto frames = room_frames<double>(10);
  auto far = frames[5];
  far.points.array() += 100;
  const point_cloud<double, 3> none;
  auto not_a_number = frames[5];
  not_a_number.points.setConstant(test::nan<double>);
  for (const auto& bad : {far, none, not_a_number}) {
    odometry_tracker<double, 3> tracker{{.voxel = 0.03}};
    Eigen::Isometry3d before = Eigen::Isometry3d::Identity(), last = before;
    for (int i = 0; i < 5; ++i)
      before = std::exchange(last, tracker.add(frames[std::size_t(i)]).pose);
    const auto map = tracker.map();
    const auto lost = tracker.add(bad);
    CHECK(lost.status == odometry_status::lost);
    CHECK(!lost.is_in_map);
    CHECK(tracker.map() == map);
    CHECK(test::difference(lost.pose, Eigen::Isometry3d{last * before.inverse() * last}) < 1e-9);
    for (int i = 6; i < 10; ++i) {
      const auto found = tracker.add(frames[std::size_t(i)]);
      CHECK(found.status == odometry_status::tracked);
      CHECK((room_pose(i).inverse() * found.pose).translation().norm() < 0.015);
    }
  }
  // The first frame with points is the first of the map.
  const auto late =
      std::vector{none, not_a_number, frames[0], frames[1]} | odometry({.voxel = 0.03});
  CHECK(late.lost() == std::vector<index_t>{0, 1});
  CHECK(late.frames[2].status == odometry_status::first);
  CHECK(late.frames[3].status == odometry_status::tracked);
  const auto empty = std::vector<point_cloud<double, 3>>{} | odometry({.voxel = 0.03});
  CHECK(empty.frames.empty());
  CHECK(empty.map.empty());
}

TEST_CASE("a frame from elsewhere in the room is not said to be tracked") {
  for (const double voxel : {0.03, 0.05})
    for (const int step : {10, 22, 32, 42, 62, 82, 102, 152}) {
      odometry_tracker<double, 3> tracker{{.voxel = voxel}};
      for (const int before : {0, 1, 2}) (void)tracker.add(room_frame<double>(before));
      const auto found = tracker.add(room_frame<double>(step));
      const double off = (room_pose(step).inverse() * found.pose).translation().norm();
      CHECK((found.status == odometry_status::tracked) == (off < 0.01));
      CHECK((step <= 22) == (found.status == odometry_status::tracked));
    }
}

TEST_CASE("a corridor does not say how far along it a frame is") {
  const auto corridor = [](double from) {
    point_cloud<double, 3> cloud{.points = Eigen::Matrix3Xd(3, 4000)};
    for (index_t i = 0; i < 4000; ++i) {
      random_stream random{3, std::uint64_t(i)};
      cloud.points.col(i) << random.uniform(from, from + 4), random.uniform(0, 1), double(i % 2);
    }
    return cloud;
  };
  odometry_tracker<double, 3> tracker{{.voxel = 0.1}};
  (void)tracker.add(corridor(0));
  const auto map = tracker.map();
  const auto found = tracker.add(corridor(0.2));
  CHECK(found.status == odometry_status::degenerate);
  CHECK(found.fit.undetermined > 0);
  CHECK(!found.is_in_map);
  CHECK(std::abs(found.pose.translation().x()) < 1e-6);
  CHECK(std::abs(found.pose.translation().z()) < 0.01);
  CHECK(tracker.map() == map);
}

TEST_CASE_TEMPLATE("far from the world's origin, and in a map that is bounded", S, float, double) {
  Eigen::Isometry3d start = Eigen::Isometry3d::Identity();
  start.translation() << 500'000, 4'000'000, 200;
  const auto frames = room_frames<S>(20);
  const auto near = frames | odometry({.voxel = 0.03, .map_radius = 3});
  const auto far = frames | odometry({.voxel = 0.03, .map_radius = 3, .initial = start});
  CHECK(far.lost().empty());
  for (std::size_t i = 0; i < frames.size(); ++i)
    CHECK(test::difference(far.frames[i].pose, Eigen::Isometry3d{start * near.frames[i].pose}) <
          0.005);
  const Eigen::Vector3d last = far.frames.back().pose.translation();
  CHECK(double(far.map.points.cwiseAbs().maxCoeff()) < 10);
  double farthest = 0;
  for (const auto& p : far.map.points.colwise())
    farthest =
        std::max(farthest, (p.template cast<double>() + far.map.full_origin() - last).norm());
  CHECK(farthest < 3.3);
  CHECK(near.map.size() < (frames | odometry({.voxel = 0.03})).map.size());
}

TEST_CASE("a stop ends it with what it has, and progress is told where the number is known") {
  const auto frames = room_frames<double>(5);
  std::vector<double> shares;
  const auto path =
      frames |
      odometry({.voxel = 0.03, .monitor = {[&](double share) { shares.push_back(share); }}});
  CHECK(shares == std::vector<double>{0.2, 0.4, 0.6, 0.8, 1});
  std::stop_source source;
  const auto stopped = frames | odometry({.voxel = 0.03,
                                          .monitor = {[&](double share) {
                                                        if (share > 0.5) source.request_stop();
                                                      },
                                                      source.get_token()}});
  CHECK(stopped.was_stopped);
  CHECK(stopped.frames.size() == 3);
  CHECK(!stopped.map.empty());
  CHECK(test::difference(stopped.frames[2].pose, path.frames[2].pose) == 0);
  odometry_tracker<double, 3> tracker{{.voxel = 0.03, .monitor = {{}, source.get_token()}}};
  CHECK_THROWS_AS(tracker.add(frames[0]), cancelled);
}

TEST_CASE("what makes no sense is refused") {
  const auto refused = [](const odometry_options& options) {
    CHECK_THROWS_AS((odometry_tracker<double, 3>{options}), invalid_input);
  };
  refused({});
  refused({.voxel = -1});
  refused({.voxel = test::nan<double>});
  refused({.voxel = 1, .frame_voxel = -1});
  refused({.voxel = 1, .max_distance = -1});
  refused({.voxel = 1, .max_distance = test::nan<double>});
  refused({.voxel = 1, .map_radius = -1});
  refused({.voxel = 1, .new_overlap = 2});
  refused({.voxel = 1, .new_voxels = -1});
  refused({.voxel = 1, .new_degrees = test::nan<double>});
  refused({.voxel = 1, .min_overlap = -0.1});
  refused({.voxel = 1, .initial = Eigen::Isometry2d::Identity()});
  refused({.voxel = 1, .initial = Eigen::Matrix4d{Eigen::Vector4d{2, 2, 2, 1}.asDiagonal()}});
  refused({.voxel = 1, .max_iterations = -1});
  refused({.voxel = 1, .threads = -1});
  odometry_tracker<double, 3> tracker{{.voxel = 0.03}};
  auto frame = room_frame<double>(0);
  frame.origin << 1, 2, 3;
  CHECK_THROWS_AS(tracker.add(frame), invalid_input);
  frame.origin.setZero();
  frame.normals = Eigen::Matrix3Xd::Zero(3, 2);
  CHECK_THROWS_AS(tracker.add(frame), invalid_input);
}
