// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <mutex>
#include <optional>
#include <stop_token>
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

/// A place, a value, and the least of them by value, then place: an order that ties do not break.
struct lowest_point {
  double value = std::numeric_limits<double>::infinity();
  std::array<double, 2> place{};
  lowest_point& operator+=(const lowest_point& other) {
    if (std::tie(other.value, other.place) < std::tie(value, place)) *this = other;
    return *this;
  }
  bool operator==(const lowest_point&) const = default;
};
static_assert(TileSum<lowest_point> && TileSum<exact_sum> && TileSum<index_t>);
static_assert(!TileSum<double> && !TileSum<std::vector<int>>);

/// What `f(survey)` gives for tiles of several edges, threads and ranks; all must be equal.
template <class S, class F>
auto same_for_all(const fs::path& path, F f) {
  const auto expected = f(open_tiles<S>(path, {.edge = 1000, .threads = 1}));
  for (const double edge : {7.0, 25.0})
    for (const int threads : {1, 4}) {
      INFO(edge, " ", threads);
      CHECK(f(open_tiles<S>(path, {.edge = edge, .threads = threads})) == expected);
    }
  for (const int count : {1, 2, 3, 4}) {
    INFO(count);
    std::mutex mutex;
    test::in_process_ranks job{count};
    job.run([&](auto& world) {
      const auto found = f(open_tiles<S>(path, {.edge = 11, .threads = 2}).on(world));
      const std::scoped_lock lock{mutex};
      CHECK(found == expected);
    });
  }
  return expected;
}

}  // namespace

TEST_CASE_TEMPLATE("what is added up over tiles is that of all points", S, float, double) {
  const test::temporary_folder folder;
  const auto cloud = terrain<S>(6000);
  write_ply(cloud, folder / "a.ply");
  const auto lowest = same_for_all<S>(folder / "a.ply", [](const auto& survey) {
    return reduce_tiles(survey, halo{0}, lowest_point{}, [](const auto& t, lowest_point& sum) {
      for (const index_t i : t.inside)
        sum += {double(t.cloud.points(2, i)),
                {double(t.cloud.points(0, i)), double(t.cloud.points(1, i))}};
    });
  });
  CHECK(lowest.value == double(cloud.points.row(2).minCoeff()));

  // How many pairs are near each other, by a halo; and two sums at once.
  const auto pairs = same_for_all<S>(folder / "a.ply", [](const auto& survey) {
    return reduce_tiles(survey, halo{1}, std::vector<index_t>{0, 0},
                        [](auto& t, std::vector<index_t>& sums) {
                          const kd_tree tree{t.cloud.points};
                          for (const index_t i : t.inside) {
                            ++sums[0];
                            sums[1] += std::ssize(tree.find(t.cloud.points.col(i), radius{1}));
                          }
                        });
  });
  index_t expected = 0;
  for (const auto& near : kd_tree{cloud.points}.find_all(cloud.points, radius{1}))
    expected += std::ssize(near);
  CHECK(pairs == std::vector<index_t>{6000, expected});
}

TEST_CASE_TEMPLATE("mean, covariance, bounds and ranges are those of the whole", S, float, double) {
  const test::temporary_folder folder;
  auto cloud = terrain<S>(5000);
  cloud.points(0, 17) = std::numeric_limits<S>::quiet_NaN();
  write_ply(cloud, folder / "a.ply");
  cloud = remove_invalid(cloud);
  const box part{.lower = {-20, -30, -9}, .upper = {40, 10, 99}};
  const auto tiled = same_for_all<S>(folder / "a.ply", [&](const auto& survey) {
    const auto found = mean_and_covariance(survey | crop(part));
    REQUIRE(found);
    return std::tuple{found->count, found->mean, found->covariance};
  });
  const auto whole = mean_and_covariance(crop(cloud, part));
  CHECK(std::get<0>(tiled) == whole->count);
  CHECK(std::get<1>(tiled).isApprox(whole->mean, S(1e-6)));
  CHECK(std::get<2>(tiled).isApprox(whole->covariance, 1e-9));

  const auto survey = open_tiles<S>(folder / "a.ply", {.edge = 9});
  const auto bounds = bounds_of(survey);
  const auto inner = bounds_of(survey | crop(part));
  REQUIRE(bounds);
  for (int d = 0; d < 3; ++d) {
    CHECK(bounds->lower[d] == survey.bounds().lower[d]);
    CHECK(bounds->upper[d] == survey.bounds().upper[d]);
    CHECK(inner->lower[d] == double(crop(cloud, part).points.row(d).minCoeff()));
  }

  const auto of_number = same_for_all<S>(folder / "a.ply", [](const auto& all) {
    const auto found = statistics_of(all, "number");
    REQUIRE(found);
    return std::array{double(found->count), found->least, found->most, found->mean,
                      found->deviation};
  });
  // All from 0 to 4999 but 17.
  const double n = 4999, sum = 12'497'500 - 17, squares = 4999.0 * 5000 * 9999 / 6 - 289;
  CHECK(of_number ==
        std::array{n, 0.0, 4999.0, sum / n, std::sqrt((n * squares - sum * sum) / n / (n - 1))});
  CHECK_THROWS_AS((void)statistics_of(survey, "height"), invalid_input);
}

TEST_CASE("the moments of points far away lose nothing") {
  const test::temporary_folder folder;
  point_cloud<double, 2> cloud;
  cloud.points.resize(2, 1000);
  for (index_t i = 0; i < 1000; ++i) cloud.points.col(i) << 1e6 + double(i % 2), 5e6;
  write_ply(cloud, folder / "a.ply");
  const auto all = open_tiles<double, 2>(folder / "a.ply", {.edge = 1});
  const auto found = mean_and_covariance(all);
  REQUIRE(found);
  const Eigen::Vector2d mean = found->mean + all.origin();
  CHECK(mean == Eigen::Vector2d{1e6 + 0.5, 5e6});
  CHECK(found->covariance == Eigen::Matrix2d{{250.0 / 999, 0}, {0, 0}});
}

TEST_CASE("of no point there is nothing, and of one no deviation") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(0), folder / "none.ply");
  write_ply(terrain<float>(1), folder / "one.ply");
  write_ply(terrain<float>(3000), folder / "many.ply");
  for (const auto& none : {open_tiles<float>(folder / "none.ply", {.edge = 1}),
                           open_tiles<float>(folder / "many.ply", {.edge = 10}) |
                               crop(box{.lower = {900, 900, 900}, .upper = {901, 901, 901}})}) {
    CHECK(!mean_and_covariance(none));
    CHECK(!bounds_of(none));
    CHECK(!statistics_of(none, "number"));
  }
  const auto one = open_tiles<float>(folder / "one.ply", {.edge = 1});
  CHECK(mean_and_covariance(one)->covariance.isZero(0));
  CHECK(statistics_of(one, "number")->deviation == 0);

  std::stop_source stop;
  stop.request_stop();
  double share = 0;
  const auto many = open_tiles<float>(folder / "many.ply", {.edge = 10});
  CHECK_THROWS_AS((void)mean_and_covariance(many, {.monitor = {.stop = stop.get_token()}}),
                  cancelled);
  (void)bounds_of(many | remove_statistical_outliers(), {.monitor = {.progress = [&](double now) {
                                                           CHECK(now >= share);
                                                           share = now;
                                                         }}});
  CHECK(share == 1);
}

TEST_CASE("what a step has moved is where it has moved to") {
  const test::temporary_folder folder;
  auto ground = terrain<double>(2000);
  ground.origin = Eigen::Vector3d{450'000, 5'400'000, 100};
  write_las(ground, folder / "a.las", {.scale = Eigen::Vector3d::Constant(0.001)});
  const auto survey = open_tiles<double>(folder / "a.las", {.edge = 20});
  const Eigen::Isometry3d away{Eigen::Translation3d{1000, -2000, 50} *
                               Eigen::AngleAxisd{0.3, Eigen::Vector3d::UnitZ()}};
  const auto moved = survey | transform(away);

  const auto all = moved.read();
  const Eigen::Vector3d expected =
      all.points.rowwise().mean() + (all.full_origin() - survey.origin());
  CHECK((mean_and_covariance(moved)->mean - expected).norm() < 1e-6);

  const auto parts = kmeans(moved, 1);
  CHECK((parts.centroids.col(0) - expected).norm() < 1e-6);
  const auto plane = ransac_hyperplane(moved, {.max_residual = 1000});
  REQUIRE(plane);
  CHECK(std::abs(plane->model.signed_distance(expected)) < 1e-3);
}

TEST_CASE("sums that do not fit beside a tile are refused before the first") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(2000), folder / "a.ply");
  const auto survey = open_tiles<float>(folder / "a.ply", {.edge = 20, .memory = 20_MB});
  CHECK_THROWS_WITH_AS(
      (void)kmeans(survey, point_matrix<float, 3>(point_matrix<float, 3>::Random(3, 20'000))),
      doctest::Contains("more than .memory of open_tiles"), invalid_input);
}
