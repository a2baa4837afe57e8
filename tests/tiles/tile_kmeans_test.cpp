// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <mutex>
#include <numeric>
#include <stop_token>
#include <string>
#include <tuple>
#include <vector>

import cilantro;
import test_support;
import rank_support;
import tile_support;
using namespace cilantro;
using test::terrain;
namespace fs = std::filesystem;

namespace {

template <class S>
auto everything(const survey_kmeans_result<S, 3>& found) {
  return std::tuple{found.centroids, found.sizes, found.inertia, found.iterations, found.converged};
}

}  // namespace

TEST_CASE_TEMPLATE("k-means of a survey has the same bits for any tiles, threads and ranks", S,
                   float, double) {
  const test::temporary_folder folder;
  write_ply(terrain<S>(12'000), folder / "a.ply");
  const kmeans_options options{.max_iterations = 12, .seed = 5};
  const auto find = [&](const tiled_cloud<S, 3>& survey) {
    return everything(
        kmeans(survey | crop(box{.lower = {-25, -99, -99}, .upper = {70, 99, 99}}), 7, options));
  };
  const auto expected = find(open_tiles<S>(folder / "a.ply", {.edge = 1000, .threads = 1}));
  CHECK(std::get<1>(expected).size() == 7);
  CHECK(std::ranges::is_sorted(std::get<1>(expected), std::ranges::greater{}));
  for (const double edge : {6.0, 30.0})
    for (const int threads : {1, 4})
      CHECK(find(open_tiles<S>(folder / "a.ply", {.edge = edge, .threads = threads})) == expected);
  for (const int count : {1, 2, 3, 4}) {
    INFO(count);
    std::mutex mutex;
    test::in_process_ranks job{count};
    job.run([&](auto& world) {
      const auto found = find(open_tiles<S>(folder / "a.ply", {.edge = 9, .threads = 2}).on(world));
      const std::scoped_lock lock{mutex};
      CHECK(found == expected);
    });
  }
}

TEST_CASE_TEMPLATE("k-means of a survey ends where that in memory does", S, float, double) {
  const test::temporary_folder folder;
  const auto cloud = terrain<S>(5000);
  write_ply(cloud, folder / "a.ply");
  const auto survey = open_tiles<S>(folder / "a.ply", {.edge = 10});
  point_matrix<S, 3> starts(3, 5);
  for (index_t c = 0; c < 5; ++c) starts.col(c) = cloud.points.col(700 * c);
  const auto found = kmeans(survey, starts, {.max_iterations = 500});
  const auto expected = kmeans(cloud.points, starts, {.max_iterations = 500});
  CHECK(found.converged);
  CHECK(found.inertia == doctest::Approx(expected.inertia).epsilon(1e-5));
  REQUIRE(found.size() == expected.size());
  auto sizes = expected.sizes();
  std::ranges::sort(sizes, std::ranges::greater{});
  CHECK(found.sizes == sizes);
  const auto labels = found.assign(cloud.points);
  for (index_t c = 0; c < found.size(); ++c) {
    CHECK(std::ranges::count(labels, c) == found.sizes[c]);
    const auto nearest = expected.assign(found.centroids);
    CHECK(found.centroids.col(c).isApprox(expected.centroids.col(nearest[c]), S(1e-4)));
  }
  // From a sample that is everything, it starts where it ends.
  const auto of_all = kmeans(survey, 5, {.max_iterations = 500, .seed = 3});
  CHECK(of_all.converged);
  CHECK(of_all.iterations <= 3);

  const auto labelled = survey | with_reach(0, [found](point_cloud<S, 3> tile) {
                          tile.set_attribute("cluster", found.assign(tile.points));
                          return tile;
                        });
  auto whole = cloud;
  whole.set_attribute("cluster", labels);
  test::check_same(labelled.read(), whole);
}

TEST_CASE("centres without points move to the farthest points, or are dropped") {
  const test::temporary_folder folder;
  point_cloud<double, 2> cloud;
  cloud.points.resize(2, 40);
  for (index_t i = 0; i < 40; ++i) cloud.points.col(i) << 10.0 * double(i % 4), 0;
  write_ply(cloud, folder / "a.ply");
  const auto survey = open_tiles<double, 2>(folder / "a.ply", {.edge = 3});
  point_matrix<double, 2> starts(2, 4);
  starts << 0, 500, 600, 700, 0, 0, 0, 0;
  const auto found = kmeans(survey, starts);
  CHECK(found.converged);
  CHECK(found.inertia == 0);
  CHECK(found.sizes == std::vector<index_t>{10, 10, 10, 10});
  CHECK(found.centroids == point_matrix<double, 2>{{0, 10, 20, 30}, {0, 0, 0, 0}});
  CHECK(kmeans(survey, 6).size() == 4);  // There are four different points.
  CHECK(kmeans(survey, 1).centroids == Eigen::Vector2d{15, 0});
}

TEST_CASE("what k-means of a survey refuses") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(0), folder / "none.ply");
  write_ply(terrain<float>(2000), folder / "many.ply");
  const auto none = open_tiles<float>(folder / "none.ply", {.edge = 5});
  const auto many = open_tiles<float>(folder / "many.ply", {.edge = 5});
  CHECK_THROWS_AS((void)kmeans(none, 1), invalid_input);
  CHECK_THROWS_AS((void)kmeans(none, point_matrix<float, 3>{{1.0f}, {1.0f}, {1.0f}}),
                  invalid_input);
  CHECK_THROWS_AS((void)kmeans(many, 0), invalid_input);
  CHECK_THROWS_AS((void)kmeans(many, 2001), invalid_input);
  CHECK_THROWS_AS((void)kmeans(many, 2, {.restarts = 0}), invalid_input);
  CHECK_THROWS_AS((void)kmeans(many, 2, {.max_iterations = -1}), invalid_input);
  CHECK_THROWS_AS((void)kmeans(many, 2, {.tolerance = -1}), invalid_input);
  CHECK_THROWS_AS((void)kmeans(many, 2, {.threads = 1}), invalid_input);
  point_matrix<float, 3> bad = point_matrix<float, 3>::Zero(3, 2);
  bad(0, 1) = std::numeric_limits<float>::infinity();
  CHECK_THROWS_AS((void)kmeans(many, bad), invalid_input);
  std::stop_source stop;
  stop.request_stop();
  CHECK_THROWS_AS((void)kmeans(many, 3, {.monitor = {.stop = stop.get_token()}}), cancelled);
  double share = 0;
  (void)kmeans(many, 3, {.monitor = {.progress = [&](double now) {
                           CHECK(now >= share);
                           share = now;
                         }}});
  CHECK(share == 1);
}

TEST_CASE("a tile costs the centres that it meets, not all of them") {
  const test::temporary_folder folder;
  const auto cloud = terrain<float>(6000);
  write_ply(cloud, folder / "a.ply");
  const auto centers = (cloud | stride(3)).points;
  const auto find = [&](const tile_options& how) {
    return everything(
        kmeans(open_tiles<float>(folder / "a.ply", how), centers, {.max_iterations = 1}));
  };
  const auto expected = find({.edge = 1000, .threads = 1});
  CHECK(std::get<1>(expected).size() > 1500);
  // The sums of 2000 centres take 9 MB, and a tile without any 3.
  CHECK(find({.edge = 1, .memory = 10_MB, .threads = 2}) == expected);
}
