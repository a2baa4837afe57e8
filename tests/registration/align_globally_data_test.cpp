// SPDX-License-Identifier: MIT
//
// Real surfaces from anywhere: found, or not claimed.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <stop_token>
#include <string>
#include <vector>

#include "spaces.hpp"

import cilantro;
import registration_support;
import test_support;

using namespace cilantro;

namespace {

struct pose_error {
  double translation, degrees;
};
template <class T>
pose_error between(const Eigen::Isometry3d& truth, const T& found) {
  const Eigen::Matrix3d turn = truth.linear().transpose() * found.linear().template cast<double>();
  return {(found.translation().template cast<double>() - truth.translation()).norm(),
          std::acos(std::clamp((turn.trace() - 1) / 2, -1.0, 1.0)) * 180 / std::numbers::pi};
}

struct kinect {
  point_cloud<float, 3> cloud;
  Eigen::Isometry3d pose;
};
kinect frame(const std::filesystem::path& folder, int number) {
  char name[32];
  std::snprintf(name, sizeof name, "frame-%06d", number);
  const std::string base = (folder / name).string();
  kinect one;
  one.cloud = cloud_from_depth(read_depth_png(base + ".depth.png"),
                               pinhole_camera<float>{640, 480, 585, 585, 320, 240}) |
              remove_invalid() | voxel_downsample(0.05);
  std::ifstream in{base + ".pose.txt"};
  Eigen::Matrix4d matrix;
  for (int i = 0; i < 16; ++i) in >> matrix(i / 4, i % 4);
  one.pose.matrix() = matrix;
  return one;
}

/// A cube of side 1 without details.
point_cloud<float, 3> plain_cube(std::uint64_t seed) {
  point_cloud<float, 3> cloud;
  cloud.points = test::random_points<test::f3>(20000, seed, 0, 1);
  for (index_t i = 0; i < cloud.size(); ++i) cloud.points(i % 3, i) = float(i / 3 % 2);
  return cloud;
}

}  // namespace

TEST_CASE("two fragments of a room are found from their features, and made precise") {
  const auto folder = test::data_file("registration/open3d_feature");
  SKIP_WITHOUT(folder);
  const auto source = read_cloud<float, 3>(*folder / "cloud_bin_1.pcd");
  const auto target = read_cloud<float, 3>(*folder / "cloud_bin_0.pcd");
  const auto turn = test::random_rigid<test::f3>(3, 3, 2);
  const auto found =
      align_globally(transform(source, turn), target, {.voxel = 0.05, .oriented = true});
  MESSAGE(found);
  CHECK(found.is_unique());
  CHECK(found.inliers.size() > 50);
  const Eigen::Isometry3f all = found.transform * turn;
  const auto fine =
      align(source, target, {.initial = all, .max_distance = 0.05, .robust = huber{0.01}});
  const auto error = between(Eigen::Isometry3d::Identity(), fine.transform);
  MESSAGE(error.translation << " m, " << error.degrees << " degrees");
  CHECK(error.translation < 0.04);
  CHECK(error.degrees < 1);
}

TEST_CASE("Kinect frames find each other across a room, and nothing is claimed that is not so") {
  const auto folder = test::data_file("rgbd/7scenes_1000");
  SKIP_WITHOUT(folder);
  std::vector<kinect> frames;
  std::vector<described_surface<float, 3>> described;
  for (const int number : {0, 100, 250, 400, 550, 700, 850, 950}) {
    frames.push_back(frame(*folder, number));
    described.push_back(
        describe_surface(frames.back().cloud, {.voxel = 0.05, .viewpoint = coordinates{0, 0, 0}}));
  }
  int unique = 0, wrong = 0;
  for (std::size_t i = 0; i < frames.size(); ++i)
    for (std::size_t j = i + 1; j < frames.size(); ++j) {
      const auto found = align_globally(described[j], described[i]);
      if (!found.is_unique()) continue;
      const auto error = between(frames[i].pose.inverse() * frames[j].pose, found.transform);
      ++unique;
      // The recorded poses themselves are off by up to 35 cm across the sequence.
      wrong += error.translation > 0.4 || error.degrees > 8;
    }
  MESSAGE(unique << " of 28 pairs are unique");
  CHECK(wrong == 0);
  CHECK(unique >= 12);
}

TEST_CASE("scans of a bunny from any two poses") {
  const auto folder = test::data_file("registration/stanford_bunny_scans");
  SKIP_WITHOUT(folder);
  const auto target = read_cloud<float, 3>(*folder / "bun000.ply");
  const auto source = read_cloud<float, 3>(*folder / "bun045.ply");
  const auto expected = align_globally(source, target, {.voxel = 0.003});
  MESSAGE(expected);
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    const auto a = test::random_rigid<test::f3>(2 * seed, 3, 1),
               b = test::random_rigid<test::f3>(2 * seed + 1, 3, 1);
    const auto found = align_globally(transform(source, a), transform(target, b), {.voxel = 0.003});
    const Eigen::Isometry3d back =
        Eigen::Isometry3d{(test::inverse(b) * found.transform * a).matrix().cast<double>()};
    const auto error = between(Eigen::Isometry3d{expected.transform.matrix().cast<double>()}, back);
    CHECK(found.status != global_status::too_few);
    CHECK(error.translation < 0.003);
    CHECK(error.degrees < 2);
  }
}

TEST_CASE("what is already aligned stays aligned") {
  const auto folder = test::data_file("registration/stanford_bunny_scans");
  SKIP_WITHOUT(folder);
  const auto cloud = read_cloud<double, 3>(*folder / "bun000.ply");
  const auto found = align_globally(cloud, cloud, {.voxel = 0.003});
  CHECK(found.is_unique());
  CHECK(found.transform.matrix().isIdentity(1e-6));
}

TEST_CASE("a plain cube fits in more than one way, and a plane does not fix itself") {
  const auto found = align_globally(plain_cube(1), plain_cube(2), {.voxel = 0.05});
  MESSAGE(found);
  CHECK(!found.is_unique());
  CHECK(!found.alternatives.empty());

  point_cloud<float, 3> plane;
  plane.points = test::random_points<test::f3>(5000, 3, 0, 1);
  plane.points.row(2).setZero();
  CHECK(!align_globally(plane, plane, {.voxel = 0.03}).is_unique());
}

TEST_CASE("empty, single and scattered points are too few") {
  const point_cloud<float, 3> none;
  point_cloud<float, 3> one{.points = Eigen::Vector3f{1, 2, 3}};
  const auto status = [](const auto& a, const auto& b) {
    return align_globally(a, b, {.voxel = 0.1}).status;
  };
  CHECK(status(none, none) == global_status::too_few);
  CHECK(status(none, one) == global_status::too_few);
  CHECK(status(one, one) == global_status::too_few);
  const point_cloud<float, 3> noise{.points = test::random_points<test::f3>(3000, 1)},
      other{.points = test::random_points<test::f3>(3000, 2)};
  CHECK(align_globally(noise, other, {.voxel = 0.1}).is_unique() == false);
  point_cloud<float, 3> invalid{.points = Eigen::Matrix3Xf::Constant(3, 10, test::nan<float>)};
  CHECK(status(invalid, one) == global_status::too_few);
}

TEST_CASE("clouds on a map are aligned relative to the target's origin") {
  const auto folder = test::data_file("registration/open3d_feature");
  SKIP_WITHOUT(folder);
  auto source = read_cloud<float, 3>(*folder / "cloud_bin_1.pcd");
  auto target = read_cloud<float, 3>(*folder / "cloud_bin_0.pcd");
  const auto plain = align_globally(source, target, {.voxel = 0.05, .oriented = true});
  target.origin = source.origin = Eigen::Vector3d{500000, 5000000, 300};
  const auto there = align_globally(source, target, {.voxel = 0.05, .oriented = true});
  CHECK(test::difference(plain.transform, there.transform) < 0.02);
  // Half a voxel grid apart, in another frame of the same world.
  source.origin += Eigen::Vector3d{10, 20, 0};
  const auto apart = align_globally(source, target, {.voxel = 0.05, .oriented = true});
  const Eigen::Vector3f shift = Eigen::Vector3f{10, 20, 0};
  CHECK((apart.transform.linear() * shift + apart.transform.translation() -
         plain.transform.translation())
            .norm() < 0.05);
}

TEST_CASE("what is described once is aligned as at once, and with the same options only") {
  const auto folder = test::data_file("registration/open3d_feature");
  SKIP_WITHOUT(folder);
  const auto source = read_cloud<float, 3>(*folder / "cloud_bin_1.pcd");
  const auto target = read_cloud<float, 3>(*folder / "cloud_bin_0.pcd");
  const auto a = describe_surface(source, {.voxel = 0.05}),
             b = describe_surface(target, {.voxel = 0.05});
  CHECK(a.features().cols() == a.size());
  CHECK(test::same_bits(align_globally(a, b).transform.matrix(),
                        align_globally(source, target, {.voxel = 0.05}).transform.matrix()));
  CHECK_THROWS_AS((void)align_globally(a, b, {.voxel = 0.05}), invalid_input);
  CHECK_THROWS_AS((void)align_globally(a, describe_surface(target, {.voxel = 0.06})),
                  invalid_input);
  CHECK_THROWS_AS(
      (void)align_globally(a, describe_surface(target, {.voxel = 0.05, .oriented = true})),
      invalid_input);
  CHECK_THROWS_AS((void)describe_surface(source, {}), invalid_input);
  CHECK_THROWS_AS(
      (void)align_globally(source, target, {.voxel = 0.05, .source_viewpoint = coordinates{0, 0}}),
      invalid_input);
}

TEST_CASE("a stop is a status, whenever it comes, and progress increases to 1") {
  const auto source = plain_cube(1), target = plain_cube(2);
  std::vector<double> shares;
  global_options options{.voxel = 0.1};
  options.monitor.progress = [&](double share) { shares.push_back(share); };
  (void)align_globally(source, target, options);
  CHECK(std::ranges::is_sorted(shares));
  REQUIRE_FALSE(shares.empty());
  CHECK(shares.back() == 1);
  for (const double at : {0.0, 0.3, 0.6, 0.8}) {
    std::stop_source stop;
    options.monitor = {[&](double share) {
                         if (share >= at) stop.request_stop();
                       },
                       stop.get_token()};
    const auto found = align_globally(source, target, options);
    CHECK(found.status == global_status::cancelled);
    CHECK(found.transform.matrix().isIdentity(0));
  }
  // Without points, too.
  shares.clear();
  options.monitor = {[&](double share) { shares.push_back(share); }, {}};
  (void)align_globally(point_cloud<float, 3>{}, target, options);
  CHECK(std::ranges::is_sorted(shares));
  CHECK(shares.back() == 1);
}

TEST_CASE("where a voxel leaves no surface to compare, two answers are not one") {
  const auto forth = test::random_rigid<test::d3>(1, 1, 3);
  const Eigen::Matrix3Xd source = test::random_points<test::d3>(200, 3, 0, 10);
  Eigen::Matrix3Xd target(3, 200);
  for (index_t i = 0; i < 200; ++i)
    target.col(i) = (i % 2 == 0 ? forth : forth.inverse()) * source.col(i);
  const auto found = align_globally(source, target, test::same_indices<double>(200),
                                    {.voxel = 0.01, .max_distance = 0.05});
  CHECK(found.status == global_status::too_few);
  CHECK(found.transform.matrix().isIdentity(0));
}
