// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <mutex>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

import cilantro;
import test_support;
import tile_support;
using namespace cilantro;
using test::check_same;
using test::terrain;
namespace fs = std::filesystem;

TEST_CASE_TEMPLATE("each step on tiles gives the bits of the whole, for tiles of any size", S,
                   float, double) {
  const test::temporary_folder folder;
  const auto path = folder / "ground.ply";
  write_ply(terrain<S>(8000), path);
  const auto whole = read_ply<S>(path);
  for (const double edge : {10.0, 33.0, 1000.0}) {
    INFO(edge);
    const auto survey = open_tiles<S>(path, {.edge = edge});
    CHECK(survey.size() == 8000);
    check_same(survey.read(), whole);
    check_same((survey | voxel_downsample(1.5)).read(), voxel_downsample(whole, 1.5));
    check_same((survey | estimate_normals(radius{1})).read(),
               estimate_normals(whole, radius{1}, {.ascending = true}));
    check_same((survey | estimate_normals(knn{10})).read(), estimate_normals(whole, knn{10}));
    check_same((survey | remove_radius_outliers({.radius = 0.5})).read(),
               remove_radius_outliers(whole, {.radius = 0.5}));
  }
}

TEST_CASE_TEMPLATE("steps after one another give the bits of the whole", S, float, double) {
  const test::temporary_folder folder;
  write_ply(terrain<S>(20'000), folder / "ground.ply");
  const auto whole = read_ply<S>(folder / "ground.ply");
  const auto steps = voxel_downsample(0.6) | remove_radius_outliers({.radius = 2}) |
                     estimate_normals(knn{12}) |
                     crop(box{.lower = {-20, -30, -9}, .upper = {60, 10, 99}});
  for (const double edge : {9.0, 40.0}) {
    const auto survey = open_tiles<S>(folder / "ground.ply", {.edge = edge});
    check_same((survey | steps).read(), whole | steps);
    check_same((survey | estimate_normals(knn{7}) | estimate_normals(knn{9})).read(),
               whole | estimate_normals(knn{7}) | estimate_normals(knn{9}));
  }
}

TEST_CASE("points that are far from all others have the neighbours that they have in the whole") {
  const test::temporary_folder folder;
  auto cloud = terrain<double>(6000);
  std::uint64_t state = 5;
  const auto uniform = [&] {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return double(state >> 11) * 0x1p-53;
  };
  for (index_t i = 0; i < 6000; i += 40) {
    // Pairs and threes at all distances from the ground, also too far away for cells of any size.
    const double up = std::exp2(40 * uniform() - 4);
    for (index_t k = 0; k < 1 + i / 40 % 3; ++k) cloud.points(2, i + k) = up + 0.01 * double(k);
  }
  write_ply(cloud, folder / "ground.ply");
  const auto whole = read_ply<double>(folder / "ground.ply");
  for (const double edge : {7.0, 24.0}) {
    INFO(edge);
    const auto survey = open_tiles<double>(folder / "ground.ply", {.edge = edge});
    for (const int k : {3, 8, 30})
      check_same((survey | estimate_normals(knn{k})).read(), estimate_normals(whole, knn{k}));
    const auto steps = voxel_downsample(0.9) | remove_statistical_outliers({.neighbors = 5}) |
                       estimate_normals(knn{5});
    check_same((survey | steps).read(), whole | steps);
  }
}

TEST_CASE_TEMPLATE("written tiles have all points, and open as what they were", S, float, double) {
  const test::temporary_folder folder;
  const auto cloud = terrain<S>(30'000);
  write_ply(cloud, folder / "ground.ply");
  const auto tiles = open_tiles<S>(folder / "ground.ply", {.edge = 15}) | write_tiles(folder / "t");
  CHECK(tiles.size() == 30'000);
  CHECK(tiles.edge() == 15);
  std::uint64_t total = 0;
  for (const auto& tile : tiles.tiles()) total += tile.points;
  CHECK(total == 30'000);
  check_same(tiles.read(), cloud);
  for (index_t t = 0; t < std::ssize(tiles.tiles()); ++t) {
    const auto info = tiles.tiles()[t];
    const auto points = read_ply<S>(tiles.files()[t]);
    CHECK(static_cast<std::uint64_t>(points.size()) == info.points);
    CHECK((points.points.row(0).array() >= S(info.x * 15)).all());
    CHECK((points.points.row(0).array() < S((info.x + 1) * 15)).all());
  }
  const auto again = open_tiles<S>(folder / "t");
  CHECK(again.tiles().size() == tiles.tiles().size());
  check_same((again | estimate_normals(knn{10})).read(), estimate_normals(again.read(), knn{10}));
}

TEST_CASE("what was written by steps is processed again") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(20'000), folder / "ground.ply");
  const auto whole = read_ply<float>(folder / "ground.ply");
  const auto survey = open_tiles<float>(folder / "ground.ply", {.edge = 10});
  const auto thin = survey | voxel_downsample(1) | write_tiles(folder / "thin");
  CHECK(!fs::exists(folder / "thin" / "tiles.unfinished"));
  check_same(thin.read(), voxel_downsample(whole, 1));
  const auto cloud = thin.read();
  check_same((thin | estimate_normals(knn{8})).read(), estimate_normals(cloud, knn{8}));
}

TEST_CASE_TEMPLATE("outliers that all points together decide are those of the whole", S, float,
                   double) {
  const test::temporary_folder folder;
  write_ply(terrain<S>(20'000), folder / "ground.ply");
  const auto whole = read_ply<S>(folder / "ground.ply");
  const auto steps =
      voxel_downsample(0.4) | remove_statistical_outliers({.neighbors = 12, .deviations = 1.5}) |
      estimate_normals(knn{8}) | remove_statistical_outliers({.neighbors = 5, .deviations = 2});
  const auto expected = whole | steps;
  CHECK(expected.size() < voxel_downsample(whole, 0.4).size());
  for (const double edge : {11.0, 50.0}) {
    const auto survey = open_tiles<S>(folder / "ground.ply", {.edge = edge}) | steps;
    check_same(survey.read(), expected);
    const auto out = folder / ("out" + std::to_string(int(edge)));
    check_same((survey | write_tiles(out)).read(), expected);
    CHECK(!fs::exists(out / "pass-1"));
    index_t total = 0;
    for_each_tile(survey, halo{1}, [&](const auto& tile) { total += std::ssize(tile.inside); });
    CHECK(total == expected.size());
  }
}

TEST_CASE_TEMPLATE("a mean of points in a square that has none itself is not lost", S, float,
                   double) {
  const test::temporary_folder folder;
  // Three points in two tiles that touch at a corner, and their mean in a third one.
  point_cloud<S, 3> corner;
  corner.points.resize(3, 3);
  corner.points << S(9.5), S(10.9), S(10.9), S(9.9), S(10), S(10), 0, 0, 0;
  write_ply(corner, folder / "corner.ply");
  check_same((open_tiles<S>(folder / "corner.ply", {.edge = 10}) | voxel_downsample(4)).read(),
             voxel_downsample(corner, 4));
  // Squares that are smaller than a voxel.
  write_ply(terrain<S>(150), folder / "few.ply");
  const auto few = read_ply<S>(folder / "few.ply");
  const auto coarse = voxel_downsample(4) | estimate_normals(knn{3}) | voxel_downsample(7);
  for (const double edge : {0.5, 2.0, 10.0}) {
    INFO(edge);
    const auto survey = open_tiles<S>(folder / "few.ply", {.edge = edge}) | coarse;
    check_same(survey.read(), few | coarse);
    index_t visited = 0;
    for_each_tile(survey, halo{0}, [&](const auto& tile) { visited += tile.cloud.size(); });
    CHECK(visited == (few | coarse).size());
  }
  const auto steps = voxel_downsample(2) | remove_statistical_outliers() | voxel_downsample(5);
  check_same(
      (open_tiles<S>(folder / "few.ply", {.edge = 3}) | steps | write_tiles(folder / "t")).read(),
      few | steps);
}

TEST_CASE("the memory of what surrounds a tile counts") {
  const test::temporary_folder folder;
  // A tile with many points, and one with a single point on each side.
  auto ground = terrain<float>(30'000);
  ground.points.row(0) = ground.points.row(0).unaryExpr([](float x) { return 5 + x / 100; });
  ground.points.row(1) = ground.points.row(1).unaryExpr([](float y) { return 5 + y / 100; });
  for (int i = 0; i < 9; ++i)
    if (i != 4) ground.points.col(i) << float(i % 3 * 10 - 5), float(i / 3 * 10 - 5), 0;
  write_ply(ground, folder / "ground.ply");
  const auto survey =
      open_tiles<float>(folder / "ground.ply", {.edge = 10, .memory = 15_MB, .threads = 8});
  std::mutex mutex;
  index_t now = 0, most = 0;
  for_each_tile(survey, halo{9.9},
                [&](auto& tile) {
                  {
                    const std::scoped_lock lock{mutex};
                    most = std::max(most, now += tile.cloud.size());
                  }
                  (void)estimate_normals(tile.cloud, knn{5});
                  const std::scoped_lock lock{mutex};
                  now -= tile.cloud.size();
                },
                {.parallel = true});
  CHECK(most >= 29'992);
  CHECK(most <= 61'000);
}

TEST_CASE("a lambda within a reach, and a struct that says its reach, run on tiles") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(5000), folder / "ground.ply");
  const auto whole = read_ply<float>(folder / "ground.ply");
  const auto count_near = [](point_cloud<float, 3> cloud) {
    std::vector<std::int32_t> counts;
    const kd_tree tree{cloud.points};
    const auto near = tree.find_all(cloud.points, radius{2});
    for (index_t i = 0; i < cloud.size(); ++i)
      counts.push_back(static_cast<std::int32_t>(near[i].size()));
    cloud.set_attribute("near", attribute_values{counts});
    return cloud;
  };
  const auto survey = open_tiles<float>(folder / "ground.ply", {.edge = 8});
  check_same((survey | with_reach(2, count_near)).read(), count_near(whole));
}

TEST_CASE("points are moved after all steps that look around, and not before") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(5000), folder / "ground.ply");
  const auto whole = read_ply<float>(folder / "ground.ply");
  const auto survey = open_tiles<float>(folder / "ground.ply", {.edge = 20});
  const auto shift = transform(rigid_transform<float, 3>{Eigen::Translation3f{100, 0, 7}});
  const auto moved = survey | estimate_normals(knn{6}) | shift | write_tiles(folder / "moved");
  check_same(moved.read(), whole | estimate_normals(knn{6}) | shift);
  CHECK(moved.bounds().lower[0] > 60);
  check_same((moved | estimate_normals(knn{9})).read(), moved.read() | estimate_normals(knn{9}));
  CHECK_THROWS_WITH_AS((void)(survey | shift | estimate_normals(knn{6})),
                       doctest::Contains("after transform has moved them"), invalid_input);
}

namespace {
struct lifted {
  [[nodiscard]] static step_reach reach() { return {}; }
  [[nodiscard]] static bool moves_points() { return true; }
  point_cloud<float, 3> operator()(point_cloud<float, 3> cloud) const {
    cloud.points.array() += 50;
    return cloud;
  }
};
}  // namespace

TEST_CASE("a function that moves points is an error where some would be lost") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(3000), folder / "a.ply");
  for (const double edge : {10.0, 1000.0})
    for (const float way : {-0.5f, 0.5f, 100.0f}) {
      const auto survey = open_tiles<float>(folder / "a.ply", {.edge = edge});
      const auto move = [way](point_cloud<float, 3> cloud) {
        cloud.points.row(0).array() += way;
        return cloud;
      };
      const std::string why = "the step with_reach has moved points";
      CHECK_THROWS_WITH_AS((void)(survey | with_reach(2, move)).read(),
                           doctest::Contains(why.c_str()), invalid_input);
      CHECK_THROWS_WITH_AS((void)(survey | with_reach(0, move) | estimate_normals(knn{5})).read(),
                           doctest::Contains(why.c_str()), invalid_input);
      CHECK((survey | with_reach(0, move)).read().size() == 3000);
      CHECK((survey | estimate_normals(knn{5}) | with_reach(0, move)).read().size() == 3000);
    }
}

TEST_CASE("attributes that only some tiles get are an error, and no data is left out") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(3000), folder / "a.ply");
  for (const bool of_dense : {false, true}) {
    const auto some = with_reach(0, [of_dense](point_cloud<float, 3> cloud) {
      if ((cloud.size() > 100) == of_dense)
        cloud.set_attribute("q", std::vector<float>(std::size_t(cloud.size())));
      return cloud;
    });
    CHECK_THROWS_AS((void)(open_tiles<float>(folder / "a.ply", {.edge = 10}) | some |
                           write_tiles(folder / ("out" + std::to_string(int(of_dense))))),
                    invalid_input);
  }
}

TEST_CASE("the progress of tiles behind a limit never goes back") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(3000), folder / "a.ply");
  const auto cloud = open_tiles<float>(folder / "a.ply", {.edge = 10}) |
                     remove_statistical_outliers({.neighbors = 5});
  std::vector<double> shares;
  const task_monitor monitor{.progress = [&](double share) { shares.push_back(share); }};
  for_each_tile(cloud, halo{0}, [](auto&) {}, {.monitor = monitor});
  CHECK(shares.back() == 1);
  CHECK(std::ranges::is_sorted(shares));
  CHECK(std::ranges::any_of(shares, [](double share) { return share > 0.5 && share < 1; }));
  shares.clear();
  (void)mean_and_covariance(cloud, {.monitor = monitor});
  CHECK(shares.back() == 1);
  CHECK(std::ranges::is_sorted(shares));
  CHECK(std::ranges::any_of(shares, [](double share) { return share > 0.5 && share < 1; }));
}

TEST_CASE("a struct that moves points says so in a pipeline, too") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(100), folder / "ground.ply");
  const auto survey = open_tiles<float>(folder / "ground.ply", {.edge = 20});
  const auto normals = estimate_normals(knn{5});
  CHECK_THROWS_AS((void)(survey | lifted{} | normals), invalid_input);
  CHECK_THROWS_AS((void)(survey | step{lifted{}} | normals), invalid_input);
  CHECK_THROWS_AS((void)(survey | (voxel_downsample(1) | lifted{} | normals)), invalid_input);
}

TEST_CASE("steps that look at the whole cloud, or write beside it, are refused by name") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(500), folder / "ground.ply");
  const auto survey = open_tiles<float>(folder / "ground.ply", {.edge = 20});
  CHECK_THROWS_WITH_AS((void)(survey | estimate_normals(knn{6}) | orient_consistently(knn{6})),
                       doctest::Contains("orient_consistently looks at the whole cloud"),
                       invalid_input);
  CHECK_THROWS_AS((void)(survey | farthest_point_sample(5)), invalid_input);
  CHECK_THROWS_AS((void)(survey | write_ply(folder / "one.ply")), invalid_input);
  pipeline_report report;
  CHECK_THROWS_AS((void)(survey | report_to(report, "here")), invalid_input);
}

TEST_CASE("a tile that is visited has its surroundings, and says what is inside") {
  const test::temporary_folder folder;
  write_ply(terrain<double>(8000), folder / "ground.ply");
  const auto whole = read_ply<double>(folder / "ground.ply");
  const auto survey = open_tiles<double>(folder / "ground.ply", {.edge = 15});
  for (const bool parallel : {false, true}) {
    std::mutex mutex;
    std::vector<index_t> inside;
    for_each_tile(survey, halo{3},
                  [&](tile<double, 3>& t) {
                    const double x = double(t.info.x) * 15, y = double(t.info.y) * 15;
                    const auto near = crop(
                        whole, box{.lower = {x - 3, y - 3, -99}, .upper = {x + 18, y + 18, 99}});
                    const std::scoped_lock lock{mutex};
                    CHECK(t.cloud.size() == near.size());
                    CHECK(static_cast<std::uint64_t>(t.inside.size()) == t.info.points);
                    for (const auto i : t.inside)
                      inside.push_back(t.cloud.template attribute_as<std::uint16_t>("number")[i]);
                  },
                  {.parallel = parallel});
    std::sort(inside.begin(), inside.end());
    CHECK(std::ssize(inside) == 8000);
    CHECK(std::adjacent_find(inside.begin(), inside.end()) == inside.end());
  }
}

TEST_CASE_TEMPLATE("coordinates of maps keep their digits", S, float, double) {
  const test::temporary_folder folder;
  auto cloud = terrain<double>(5000);
  cloud.origin = Eigen::Vector3d{4'500'000, -300'000, 0};
  write_ply(cloud, folder / "map.ply");
  const auto survey = open_tiles<S>(folder / "map.ply", {.edge = 13});
  const auto all = survey.read();
  CHECK(all.size() == 5000);
  const auto expected = cast<double>(all);
  const auto world = [](const point_cloud<double, 3>& c) {
    auto moved = c;
    moved.points.colwise() += c.full_origin();
    moved.origin.setZero();
    return test::sorted(moved);
  };
  CHECK((world(expected).points - world(cloud).points).cwiseAbs().maxCoeff() < 2e-5);
  const auto tiles = survey | write_tiles(folder / "t");
  check_same(tiles.read(), all);
  check_same((tiles | estimate_normals(knn{10})).read(), estimate_normals(tiles.read(), knn{10}));
  check_same(open_tiles<S>(folder / "t").read(), all);
}

TEST_CASE("points that are not finite belong to no tile") {
  const test::temporary_folder folder;
  auto cloud = terrain<float>(500);
  cloud.points(1, 7) = std::numeric_limits<float>::quiet_NaN();
  cloud.points(0, 8) = std::numeric_limits<float>::infinity();
  cloud.points(0, 499) = 3e37f;
  write_ply(cloud, folder / "a.ply");
  const auto survey = open_tiles<float>(folder / "a.ply");
  CHECK(survey.size() == 500);
  CHECK(survey.read().size() == 498);
  CHECK((survey | write_tiles(folder / "t")).read().size() == 498);
}

TEST_CASE("the bits do not depend on the number of threads or on the memory") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(20'000), folder / "ground.ply");
  const auto steps = voxel_downsample(0.3) | estimate_normals(knn{9});
  const auto first = (open_tiles<float>(folder / "ground.ply", {.edge = 9}) | steps).read();
  for (const int threads : {1, 3, 8})
    CHECK((open_tiles<float>(folder / "ground.ply",
                             {.edge = 9, .memory = 10_MB, .threads = threads}) |
           steps)
              .read() == first);
}

TEST_CASE("points in two dimensions are tiled, too") {
  const test::temporary_folder folder;
  point_cloud<float, 2> cloud;
  cloud.points = point_matrix<float, 2>::Random(2, 3000) * 20;
  write_ply(cloud, folder / "a.ply");
  const auto survey = open_tiles<float, 2>(folder / "a.ply", {.edge = 6});
  const auto tiled = (survey | estimate_normals(knn{8})).read();
  const auto whole = estimate_normals(survey.read(), knn{8});
  CHECK((tiled.points == whole.points));
  CHECK((tiled.normals == whole.normals));
}
