// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <tuple>
#include <vector>

import cilantro;
import test_support;
import rank_support;
import tile_support;
using namespace cilantro;
namespace fs = std::filesystem;

namespace {

/// A sloping ground, a smaller roof, and points anywhere.
template <class S>
point_cloud<S, 3> ground_and_roof(index_t n) {
  point_cloud<S, 3> cloud;
  cloud.points.resize(3, n);
  for (index_t i = 0; i < n; ++i) {
    random_stream random{7, std::uint64_t(i)};
    const double x = random.uniform(-40, 40), y = random.uniform(-30, 30);
    double z = 0.1 * x - 0.05 * y + 0.02 * random.normal();
    if (i % 10 < 3) z = 8 + 0.3 * y + 0.02 * random.normal();
    if (i % 10 == 9) z = random.uniform(-10, 20);
    cloud.points.col(i) << S(x), S(y), S(z);
  }
  return cloud;
}

template <int D>
auto everything(const std::optional<survey_plane<D>>& found) {
  REQUIRE(found);
  return std::tuple{found->model.normal, found->model.offset, found->inliers,
                    found->score,        found->rmse,         found->iterations};
}

}  // namespace

TEST_CASE_TEMPLATE("the plane of a survey is that of all points, for any tiles, threads and ranks",
                   S, float, double) {
  const test::temporary_folder folder;
  const auto cloud = ground_and_roof<S>(20'000);
  write_ply(cloud, folder / "a.ply");
  const ransac_options options{.max_residual = 0.1, .seed = 2};
  const auto expected =
      ransac_hyperplane(open_tiles<S>(folder / "a.ply", {.edge = 1000, .threads = 1}), options);
  const auto of_memory = ransac(hyperplane_family{cloud.points}, options);
  REQUIRE(expected);
  CHECK(expected->inliers == doctest::Approx(double(of_memory->inliers.size())).epsilon(1e-3));
  CHECK(expected->model.normal.isApprox(of_memory->model.normal, 1e-4));
  CHECK(expected->rmse == doctest::Approx(of_memory->rmse).epsilon(1e-3));
  CHECK(expected->score == doctest::Approx(of_memory->score).epsilon(1e-3));
  // Fitted to its inliers, which are counted.
  index_list inliers;
  for (index_t i = 0; i < cloud.size(); ++i)
    if (std::abs(expected->model.signed_distance(cloud.points.col(i))) <= 0.1)
      inliers.push_back(static_cast<std::int32_t>(i));
  CHECK(std::ssize(inliers) == expected->inliers);
  const auto fitted = hyperplane_family{cloud.points}.fit(inliers);
  CHECK(fitted->normal.isApprox(expected->model.normal, 1e-9));
  CHECK(fitted->offset == doctest::Approx(expected->model.offset).epsilon(1e-9));

  const auto same = everything(expected);
  for (const double edge : {7.0, 25.0})
    for (const int threads : {1, 4})
      CHECK(everything(ransac_hyperplane(
                open_tiles<S>(folder / "a.ply", {.edge = edge, .threads = threads}), options)) ==
            same);
  for (const int count : {1, 2, 3, 4}) {
    INFO(count);
    std::mutex mutex;
    test::in_process_ranks job{count};
    job.run([&](auto& world) {
      const auto found = ransac_hyperplane(
          open_tiles<S>(folder / "a.ply", {.edge = 12, .threads = 2}).on(world), options);
      const std::scoped_lock lock{mutex};
      CHECK(everything(found) == same);
    });
  }

  // The roof is next, once the ground is gone.
  const auto rest = open_tiles<S>(folder / "a.ply", {.edge = 9}) |
                    with_reach(0, [plane = expected->model](point_cloud<S, 3> tile) {
                      return select(tile, [&](index_t i) {
                        return std::abs(plane.signed_distance(tile.points.col(i))) > 0.1;
                      });
                    });
  const auto roof = ransac_hyperplane(rest, options);
  REQUIRE(roof);
  const Eigen::Vector3d across = Eigen::Vector3d{0, -0.3, 1}.normalized();
  CHECK(roof->model.normal.isApprox(across, 1e-2));
}

TEST_CASE("more points than are looked at first: all of them decide") {
  const test::temporary_folder folder;
  write_ply(ground_and_roof<float>(120'000), folder / "a.ply");
  const auto survey = open_tiles<float>(folder / "a.ply", {.edge = 20});
  const auto found = ransac_hyperplane(
      survey, {.max_residual = 0.1, .score = ransac_score::inliers, .min_inliers = 70'000});
  REQUIRE(found);
  CHECK(found->inliers > 71'900);
  CHECK(found->inliers < 75'000);
  CHECK(found->score == double(found->inliers));
  CHECK(!ransac_hyperplane(survey, {.max_residual = 0.1, .min_inliers = 90'000}));
}

TEST_CASE("lines in two dimensions, too few points, and what is refused") {
  const test::temporary_folder folder;
  point_cloud<double, 2> line;
  line.points.resize(2, 300);
  for (index_t i = 0; i < 300; ++i)
    line.points.col(i) << double(i), i % 5 == 0 ? double(i * 7 % 100) : 5 - 0.5 * double(i);
  write_ply(line, folder / "line.ply");
  const auto found = ransac_hyperplane(open_tiles<double, 2>(folder / "line.ply", {.edge = 10}),
                                       {.max_residual = 0.01});
  REQUIRE(found);
  CHECK(found->inliers == 240);
  CHECK(found->model.normal.isApprox(Eigen::Vector2d{0.5, 1}.normalized(), 1e-9));

  write_ply(test::terrain<float>(0), folder / "none.ply");
  write_ply(test::terrain<float>(1), folder / "one.ply");
  write_ply(test::terrain<float>(2000), folder / "many.ply");
  for (const char* name : {"none.ply", "one.ply"})
    CHECK(!ransac_hyperplane(open_tiles<float>(folder / name, {.edge = 1}), {.max_residual = 1}));
  const auto many = open_tiles<float>(folder / "many.ply", {.edge = 10});
  CHECK_THROWS_AS((void)ransac_hyperplane(many, {.max_residual = 0}), invalid_input);
  CHECK_THROWS_AS((void)ransac_hyperplane(many, {.max_residual = 1, .confidence = 2}),
                  invalid_input);
  CHECK_THROWS_AS((void)ransac_hyperplane(many, {.max_residual = 1, .min_inliers = -1}),
                  invalid_input);
  CHECK_THROWS_AS((void)ransac_hyperplane(many, {.max_residual = 1, .threads = 2}), invalid_input);
  std::stop_source stop;
  stop.request_stop();
  CHECK_THROWS_AS(
      (void)ransac_hyperplane(many, {.max_residual = 1, .monitor = {.stop = stop.get_token()}}),
      cancelled);
  double share = 0;
  (void)ransac_hyperplane(many, {.max_residual = 1, .monitor = {.progress = [&](double now) {
                                                      CHECK(now >= share);
                                                      share = now;
                                                    }}});
  CHECK(share == 1);
}

TEST_CASE("a small plane is found among points anywhere, wherever it lies") {
  for (const std::uint64_t place : {1u, 2u, 3u, 4u}) {
    INFO(place);
    const test::temporary_folder folder;
    point_cloud<float, 3> cloud;
    cloud.points.resize(3, 120'000);
    random_stream random{place};
    const double x = random.uniform(10, 80), y = random.uniform(10, 80);
    for (index_t i = 0; i < cloud.size(); ++i) {
      // One of 100 is on a roof of 10 by 10.
      const double u = random.uniform(0, 10), v = random.uniform(0, 10);
      if (i % 100 == 0)
        cloud.points.col(i) << float(x + u), float(y + v),
            float(8 + 0.5 * u + 0.02 * random.normal());
      else
        cloud.points.col(i) << float(random.uniform(0, 100)), float(random.uniform(0, 100)),
            float(random.uniform(0, 40));
    }
    write_ply(cloud, folder / "a.ply");
    const auto found = ransac_hyperplane(open_tiles<float>(folder / "a.ply", {.edge = 40}),
                                         {.max_residual = 0.1, .seed = place});
    REQUIRE(found);
    CHECK(std::abs(found->model.normal.dot(Eigen::Vector3d{-0.5, 0, 1}.normalized())) > 0.99);
    CHECK(found->inliers > 1000);
  }
}
