// SPDX-License-Identifier: MIT
//
// Many scans of one room, and of several: in their places, or said to be apart.
#include <algorithm>
#include <cstddef>
#include <sstream>
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

constexpr double voxel = 0.06;

struct room_scan {
  point_cloud<float, 3> cloud;
  Eigen::Isometry3d pose;
};
room_scan scan(int step) {
  auto frame = simulate(step, {.width = 160, .height = 120, .noise = 0.002});
  room_scan one{{}, Eigen::Isometry3d{frame.camera.to_world}};
  frame.camera.to_world.setIdentity();
  one.cloud = cast<float>(cloud_from_depth(frame.depth, frame.camera) | remove_invalid());
  return one;
}

struct walk {
  std::vector<point_cloud<float, 3>> clouds;
  std::vector<Eigen::Isometry3d> poses;

  explicit walk(const std::vector<int>& steps) {
    for (const int step : steps) {
      auto one = scan(step);
      clouds.push_back(std::move(one.cloud));
      poses.push_back(one.pose);
    }
  }
  /// How far a scan lies from where it belongs, relative to the first one.
  [[nodiscard]] double error(const Eigen::Isometry3d& found, std::size_t i) const {
    const Eigen::Isometry3d truth = poses[0].inverse() * poses[i];
    return (found.translation() - truth.translation()).norm();
  }
};

align_many_options seen(double edge = voxel) {
  return {.voxel = edge, .viewpoint = coordinates{0, 0, 0}};
}

/// A scan of another room, which nothing rigid makes the same: the mirror image.
point_cloud<float, 3> mirrored(point_cloud<float, 3> cloud) {
  cloud.points.row(0) *= -1;
  return cloud;
}

}  // namespace

TEST_CASE("frames of a simulated room lie within a voxel of the truth") {
  const walk room{{0, 6, 12, 18, 24, 30}};
  const auto found = align_many(room.clouds, seen());
  CHECK(found.status == pose_graph_status::converged);
  REQUIRE(found.poses.size() == 6);
  double worst = 0;
  for (std::size_t i = 0; i < 6; ++i) worst = std::max(worst, room.error(found.poses[i], i));
  MESSAGE("farthest: " << worst << " m");
  CHECK(worst < voxel);
  CHECK(found.component_of == index_list(6, 0));
  std::ostringstream text;
  text << found;
  CHECK(text.str().find("pairs of scans") != std::string::npos);
  CHECK(std::ranges::is_sorted(
      found.pairs, {}, [](const scan_pair& pair) { return std::pair{pair.source, pair.target}; }));
}

TEST_CASE("any two frames of a room that are called unique are where they should be") {
  const walk room{{0, 10, 25, 45, 70, 120}};
#if __has_feature(address_sanitizer)
  constexpr std::size_t frames = 3;
#else
  constexpr std::size_t frames = 6;
#endif
  int unique = 0;
  for (std::size_t i = 0; i < frames; ++i)
    for (std::size_t j = 0; j < frames; ++j) {
      if (i == j) continue;
      const auto found = align_globally(room.clouds[i], room.clouds[j],
                                        {.voxel = voxel,
                                         .source_viewpoint = coordinates{0, 0, 0},
                                         .target_viewpoint = coordinates{0, 0, 0}});
      if (!found.is_unique()) continue;
      ++unique;
      const Eigen::Isometry3d truth = room.poses[j].inverse() * room.poses[i];
      CHECK((found.transform.translation().cast<double>() - truth.translation()).norm() < 0.2);
    }
  MESSAGE(unique << " of " << frames * (frames - 1) << " are unique");
  CHECK(unique >= (frames == 6 ? 4 : 1));
}

TEST_CASE("scans that share nothing are in components of their own, with poses of their own") {
  const walk room{{0, 6, 12}};
  auto scans = room.clouds;
  for (const std::size_t i : {0U, 1U, 2U}) scans.push_back(mirrored(room.clouds[i]));
  const auto found = align_many(scans, seen());
  CHECK(found.component_of == index_list{0, 0, 0, 1, 1, 1});
  CHECK(found.status == pose_graph_status::disconnected);
  for (const std::size_t first : {0U, 3U}) CHECK(found.poses[first].matrix().isIdentity(1e-12));
  for (const std::size_t i : {1U, 2U}) {
    Eigen::Vector3d there = found.poses[i + 3].translation();
    there[0] *= -1;
    CHECK((there - found.poses[i].translation()).norm() < voxel);
  }
}

TEST_CASE("a scan that is repeated lies on itself") {
  const walk room{{0, 0, 0, 0}};
  const auto found = align_many(room.clouds, seen());
  CHECK(found.status == pose_graph_status::converged);
  for (const auto& pose : found.poses) CHECK(pose.matrix().isIdentity(1e-6));
}

TEST_CASE("no scan, one, and such without points") {
  const std::vector<point_cloud<float, 3>> none;
  CHECK(align_many(none, seen()).poses.empty());
  const walk room{{0}};
  const auto one = align_many(room.clouds, seen());
  REQUIRE(one.poses.size() == 1);
  CHECK(one.poses[0].matrix().isIdentity(0));
  const std::vector<point_cloud<float, 3>> some{{}, room.clouds[0], {}, room.clouds[0]};
  const auto found = align_many(some, seen());
  CHECK(found.component_of == index_list{0, 1, 2, 1});
}

TEST_CASE("scans start from poses that are known, and only neighbours there are looked at") {
  const walk room{{0, 6, 12, 18}};
  auto options = seen();
  for (std::size_t i = 0; i < 4; ++i) {
    Eigen::Isometry3d near = room.poses[i];
    near.translation()[0] += 0.03 * double(i);
    options.initial.emplace_back(near);
  }
  const auto found = align_many(room.clouds, options);
  CHECK(found.status == pose_graph_status::converged);
  for (std::size_t i = 0; i < 4; ++i)
    CHECK(room.error(found.poses[0].inverse() * found.poses[i], i) < voxel);

  // Where they are far apart, nothing is aligned, and poses stay.
  for (std::size_t i = 0; i < 4; ++i)
    options.initial[i] = Eigen::Isometry3d{Eigen::Translation3d{100.0 * double(i), 0, 0}};
  const auto apart = align_many(room.clouds, options);
  CHECK(apart.pairs.empty());
  CHECK(apart.poses[3].translation()[0] == 300);
}

TEST_CASE("the same bits for one thread and four") {
  const walk room{{0, 8, 16}};
  auto options = seen();
  options.threads = 1;
  const auto one = align_many(room.clouds, options);
  options.threads = 4;
  const auto four = align_many(room.clouds, options);
  for (std::size_t i = 0; i < 3; ++i) CHECK(one.poses[i].matrix() == four.poses[i].matrix());
  CHECK(one.cost == four.cost);
}

TEST_CASE("progress increases to 1, and a stop on the way ends it") {
  const walk room{{0, 8, 16}};
  auto options = seen();
  std::vector<double> shares;
  options.monitor.progress = [&](double share) { shares.push_back(share); };
  (void)align_many(room.clouds, options);
  CHECK(std::ranges::is_sorted(shares));
  REQUIRE_FALSE(shares.empty());
  CHECK(shares.back() == 1);

  std::stop_source stop;
  options.monitor = {[&](double) { stop.request_stop(); }, stop.get_token()};
  CHECK_THROWS_AS((void)align_many(room.clouds, options), cancelled);
}

TEST_CASE("wrong options for many scans get a sentence") {
  const walk room{{0, 6}};
  CHECK_THROWS_AS((void)align_many(room.clouds, {}), invalid_input);
  CHECK_THROWS_AS((void)align_many(room.clouds, {.voxel = -1}), invalid_input);
  CHECK_THROWS_AS((void)align_many(room.clouds, {.voxel = voxel, .min_overlap = 2}), invalid_input);
  CHECK_THROWS_AS((void)align_many(room.clouds, {.voxel = voxel, .viewpoint = coordinates{0, 0}}),
                  invalid_input);
  auto options = seen();
  options.initial.emplace_back(Eigen::Isometry3d::Identity());
  CHECK_THROWS_AS((void)align_many(room.clouds, options), invalid_input);
  options.initial.emplace_back(Eigen::Affine3d{2 * Eigen::Matrix3d::Identity()});
  CHECK_THROWS_AS((void)align_many(room.clouds, options), invalid_input);
}
