// SPDX-License-Identifier: MIT
//
// What steps before a limit of all points give is put aside by tile, and must come back in the
// order of the whole: where points are equally near, and where sums are rounded, that order
// decides.
#include <doctest/doctest.h>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

import cilantro;
import test_support;
import tile_support;
using namespace cilantro;
using test::check_same;
using test::terrain;
namespace fs = std::filesystem;

namespace {

/// Points of a lattice, in an order that has nothing to do with places, some of them several times,
/// and a few above it; with colours.
template <class S>
point_cloud<S, 3> lattice() {
  constexpr index_t n = 2400;
  point_cloud<S, 3> cloud;
  cloud.points.resize(3, n);
  cloud.colors.resize(3, n);
  std::vector<std::uint16_t> number(n);
  for (index_t i = 0; i < n; ++i) {
    const index_t k = i * 7919 % n;
    cloud.points.col(i) << S(0.5 + double(k % 30)), S(double(k / 30 % 20) - 7), S(k / 600 % 2);
    if (k % 97 == 0) cloud.points(2, i) += S(3);
    cloud.colors.col(i) << float(i % 256) / 255, float(i * 7 % 256) / 255, float(k % 256) / 255;
    number[i] = static_cast<std::uint16_t>(k);
  }
  cloud.set_attribute("number", attribute_values{std::move(number)});
  return cloud;
}

/// As a cloud comes back from a file.
template <class S>
point_cloud<S, 3> written(const point_cloud<S, 3>& cloud, const fs::path& folder) {
  write_ply(cloud, folder / "written.ply");
  return open_tiles<S>(folder / "written.ply").read();
}

template <class S>
void check_same_colors(const point_cloud<S, 3>& tiled, const point_cloud<S, 3>& whole) {
  check_same(tiled, whole);
  CHECK((test::sorted(tiled).colors == test::sorted(whole).colors));
}

/// Runs `steps` over tiles of two sizes, with one thread and several.
template <class S, class Steps>
void check_written(const point_cloud<S, 3>& cloud, const Steps& steps) {
  const test::temporary_folder folder;
  write_ply(cloud, folder / "points.ply");
  for (const auto& [edge, threads] : {std::pair{6.0, 3}, std::pair{11.0, 1}}) {
    INFO(edge);
    const auto survey = open_tiles<S>(folder / "points.ply", {.edge = edge, .threads = threads});
    const auto expected = survey.read_box(survey.bounds()) | steps;
    REQUIRE(expected.size() > 0);
    const auto out = folder / std::to_string(threads);
    bool is_put_aside = false;
    const auto look = [&](double) { is_put_aside |= fs::exists(out / "pass-1/tiles.index"); };
    const auto result = survey | steps | write_tiles(out, {.monitor = {.progress = look}});
    check_same_colors(result.read(), written(expected, folder.path()));
    CHECK(is_put_aside);
    CHECK(!fs::exists(out / "pass-1"));
  }
}

template <class S>
auto clouds() {
  auto map = lattice<S>();
  map.origin = Eigen::Vector3d{4'500'000, -300'000, 0};
  return std::vector{lattice<S>(), terrain<S>(6000), map};
}

}  // namespace

TEST_CASE_TEMPLATE("voxels, outliers and normals that are written are those of the whole", S, float,
                   double) {
  for (const auto& cloud : clouds<S>()) {
    check_written(cloud, voxel_downsample(1.5) | remove_statistical_outliers({.deviations = 2}) |
                             estimate_normals(knn{6}));
    check_written(cloud, voxel_downsample(Eigen::Vector3d{2, 1.25, 0.75},
                                          {.origin = Eigen::Vector3d{0.3, -0.4, 0.1}}) |
                             remove_statistical_outliers() | voxel_downsample(2.5));
    check_written(cloud, voxel_downsample(1.5, {.pick = voxel_representative::nearest_to_center}) |
                             remove_statistical_outliers() |
                             estimate_normals(radius{3}, {.ascending = true}));
  }
}

TEST_CASE_TEMPLATE("outliers and normals that are written are those of the whole", S, float,
                   double) {
  for (const auto& cloud : clouds<S>()) {
    check_written(cloud, remove_statistical_outliers() | estimate_normals(knn{5}));
    const auto at = cloud.full_origin();
    const Eigen::Vector3d low = at + Eigen::Vector3d{2, -6, -9},
                          high = at + Eigen::Vector3d{27, 12, 9};
    check_written(cloud, crop(box{.lower = low, .upper = high}) | remove_statistical_outliers() |
                             voxel_downsample(1.5) | estimate_normals(knn{6}));
  }
}

TEST_CASE_TEMPLATE("limits after limits are those of the whole", S, float, double) {
  for (const auto& cloud : clouds<S>()) {
    check_written(cloud, remove_statistical_outliers({.neighbors = 6, .deviations = 2}) |
                             remove_statistical_outliers({.neighbors = 9, .deviations = 1}) |
                             estimate_normals(knn{6}));
    check_written(cloud, voxel_downsample(1.25) | remove_statistical_outliers({.deviations = 2}) |
                             estimate_normals(knn{7}) | voxel_downsample(2.2) |
                             remove_statistical_outliers({.neighbors = 5}) |
                             estimate_normals(knn{5}));
  }
}

TEST_CASE("where places are not known, points are not put aside, and the bits are the same") {
  const test::temporary_folder folder;
  write_ply(lattice<double>(), folder / "points.ply");
  const auto survey = open_tiles<double>(folder / "points.ply", {.edge = 7});
  const auto whole = survey.read_box(survey.bounds());
  const auto check = [&](const auto& steps, const std::string& name) {
    const auto out = folder / name;
    const auto look = [&](double) { CHECK(!fs::exists(out / "pass-1")); };
    check_same((survey | steps | write_tiles(out, {.monitor = {.progress = look}})).read(),
               whole | steps);
  };
  const auto as_it_is = with_reach(0, [](point_cloud<double, 3> cloud) {
    CHECK(cloud.attributes.size() <= 1);
    return cloud;
  });
  const auto rest = remove_statistical_outliers() | estimate_normals(knn{5});
  check(as_it_is | rest, "function");
  check(voxel_downsample(1.5) | as_it_is | rest, "function behind");
  // Cells that are too many to be numbered.
  check(voxel_downsample(1e-12) | rest, "cells");
}

TEST_CASE("a function of the user before voxels sees points as they were, and voxels have places") {
  check_written(lattice<double>(), with_reach(0,
                                              [](point_cloud<double, 3> cloud) {
                                                CHECK(cloud.attributes.size() <= 1);
                                                return cloud;
                                              }) |
                                       voxel_downsample(1.5) | remove_statistical_outliers() |
                                       estimate_normals(knn{5}));
}

TEST_CASE("a run that is stopped in any of its passes goes on to the bits of the whole") {
  const test::temporary_folder folder;
  write_ply(lattice<float>(), folder / "points.ply");
  const auto survey = open_tiles<float>(folder / "points.ply", {.edge = 6, .threads = 1});
  const auto steps = voxel_downsample(1.5) | remove_statistical_outliers({.deviations = 2}) |
                     estimate_normals(knn{6});
  const auto expected = survey.read_box(survey.bounds()) | steps;
  for (int k = 1; k < 20; ++k) {
    INFO(k);
    const auto out = folder / std::to_string(k);
    std::stop_source stop;
    const auto look = [&](double share) {
      if (share >= 0.05 * k) stop.request_stop();
    };
    CHECK_THROWS_AS(
        (void)(survey | steps |
               write_tiles(out, {.monitor = {.progress = look, .stop = stop.get_token()}})),
        cancelled);
    check_same((survey | steps | write_tiles(out, {.resume = true})).read(), expected);
    for (const auto& entry : fs::directory_iterator{out})
      CHECK((entry.path().extension() == ".ply" || entry.path().filename() == "tiles.index"));
  }
}

TEST_CASE_TEMPLATE("what other tiles read of points that are put aside lies together", S, float,
                   double) {
  const test::temporary_folder folder;
  write_ply(terrain<S>(20'000), folder / "points.ply");
  const auto survey = open_tiles<S>(folder / "points.ply", {.edge = 30, .threads = 2});
  const auto steps = voxel_downsample(0.8) |
                     remove_statistical_outliers({.neighbors = 3, .deviations = 2}) |
                     estimate_normals(knn{3});
  const auto out = folder / "out";
  int parts_at_most = 0;
  const auto look = [&](double) {
    if (parts_at_most > 0 || !fs::exists(out / "pass-1/tiles.index")) return;
    for (const auto& entry : fs::directory_iterator{out / "pass-1"}) {
      if (entry.path().extension() != ".ply") continue;
      const auto tile = read_ply<S>(entry.path());
      const auto places = tile.template attribute_as<double>("cilantro_place");
      int parts = 1;
      // Bits of places, as doubles, ascend as they do.
      for (std::size_t i = 1; i < places.size(); ++i) parts += places[i] < places[i - 1] ? 1 : 0;
      parts_at_most = std::max(parts_at_most, parts);
    }
  };
  const auto result = survey | steps | write_tiles(out, {.monitor = {.progress = look}});
  CHECK(parts_at_most > 1);
  CHECK(parts_at_most <= 9);
  const auto expected = survey.read_box(survey.bounds()) | steps;
  REQUIRE(expected.size() > 3000);
  check_same(result.read(), written(expected, folder.path()));
}

TEST_CASE("points in two dimensions are put aside in their places, too") {
  const test::temporary_folder folder;
  point_cloud<float, 2> cloud;
  cloud.points = (point_matrix<float, 2>::Random(2, 3000).array() * 20 + 20).round();
  write_ply(cloud, folder / "a.ply");
  const auto steps = voxel_downsample(1.5) | remove_statistical_outliers({.deviations = 2}) |
                     estimate_normals(knn{6});
  const auto survey = open_tiles<float, 2>(folder / "a.ply", {.edge = 1000});
  const auto in_order = survey | steps | write_tiles(folder / "one");
  const auto whole = survey.read_box(survey.bounds()) | steps;
  CHECK((in_order.read().points == whole.points));
  CHECK((in_order.read().normals == whole.normals));
  const auto by_tile =
      open_tiles<float, 2>(folder / "a.ply", {.edge = 6}) | steps | write_tiles(folder / "many");
  const auto tile = by_tile.tiles()[5];
  const auto expected =
      crop(whole, box{.lower = {double(tile.x) * 6, double(tile.y) * 6},
                      .upper = {double(tile.x) * 6 + 5.99999, double(tile.y) * 6 + 5.99999}});
  CHECK((by_tile.read_tile(5).points == expected.points));
  CHECK((by_tile.read_tile(5).normals == expected.normals));
}

TEST_CASE("a step that changes the order of points is told so where it would be lost") {
  const test::temporary_folder folder;
  write_ply(lattice<double>(), folder / "points.ply");
  const auto survey = open_tiles<double>(folder / "points.ply", {.edge = 7});
  struct turned {
    static step_reach reach() { return {}; }
    void choose(const point_cloud<double, 3>&, chosen_points& kept) const {
      index_list places;
      for (index_t k = kept.size(); k-- > 0;) places.push_back(static_cast<std::int32_t>(k));
      kept.keep(places);
    }
  };
  CHECK_THROWS_WITH_AS((void)(survey | choosing_step{turned{}} | remove_statistical_outliers() |
                              estimate_normals(knn{5}) | write_tiles(folder / "out")),
                       doctest::Contains("changes their order"), invalid_input);
}

TEST_CASE_TEMPLATE("samples by places are those of the whole", S, float, double) {
  const test::temporary_folder folder;
  const auto ground = terrain<S>(2000);
  fs::create_directory(folder / "in");
  for (const int part : {2, 0, 1})
    write_ply(select(ground, [&](index_t i) { return i % 3 == part; }),
              folder / ("in/" + std::to_string(part) + ".ply"));
  (void)(open_tiles<S>(folder / "in", {.edge = 20}) | write_tiles(folder / "cut"));
  const Eigen::Transform<S, 3, Eigen::Isometry> moved{Eigen::Translation<S, 3>{3, 4, 5}};
  const auto check = [&](const auto& steps) {
    for (const char* name : {"in", "cut"})
      for (const double edge : {12.0, 1000.0}) {
        INFO(name, " ", edge);
        const auto survey = open_tiles<S>(folder / name, {.edge = edge, .threads = 2});
        const auto whole = survey.read_box(survey.bounds()) | steps;
        check_same((survey | steps).read(), whole);
        const auto out = folder / "out";
        fs::remove_all(out);
        check_same((survey | steps | write_tiles(out)).read(), whole);
      }
  };
  check(stride(7));
  check(take(1234));
  check(random_sample(500, {.seed = 3}));
  check(random_sample(100'000));
  check(uniform_sample(77));
  check(stride(3) | take(500) | random_sample(300) | stride(2));
  check(estimate_normals(knn{6}) | stride(5));
  check(stride(5) | estimate_normals(knn{6}));
  check(random_sample(12) | estimate_normals(knn{6}));
  check(take(40) | estimate_normals(knn{6}));
  check(random_sample(1400) | voxel_downsample(0.7) | estimate_normals(knn{6}));
  check(stride(2) | remove_statistical_outliers({.neighbors = 6, .deviations = 2}) |
        estimate_normals(knn{6}));
  check(transform(moved) | stride(4));
  CHECK((open_tiles<S>(folder / "in", {.edge = 20}) | take(0)).read().empty());
}

TEST_CASE("what is read for the nearest points of a sample is in the budget") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(200'000), folder / "ground.ply");
  const auto sampled = [&](std::uint64_t memory, index_t count) {
    return (open_tiles<float>(folder / "ground.ply", {.edge = 5, .memory = memory}) |
            random_sample(count) | estimate_normals(knn{10}))
        .read()
        .size();
  };
  // Ten points are near each other in all of the survey only, which takes more than 50 MB.
  CHECK_THROWS_AS((void)sampled(40_MB, 20), invalid_input);
  CHECK(sampled(1_GB, 20) == 20);
  CHECK(sampled(40_MB, 100'000) == 100'000);
}

TEST_CASE("where places are not known, samples are refused, and what to write instead is told") {
  const test::temporary_folder folder;
  auto ground = terrain<float>(500);
  write_ply(ground, folder / "ground.ply");
  const auto survey = open_tiles<float>(folder / "ground.ply", {.edge = 20});
  const box part{.lower = {0, -99, -99}, .upper = {99, 99, 99}};
  CHECK_THROWS_WITH_AS((void)(survey | crop(part) | stride(2)),
                       doctest::Contains("which no tile knows after the step crop: put it before"),
                       invalid_input);
  CHECK_THROWS_AS((void)(survey | voxel_downsample(1) | random_sample(5)), invalid_input);
  CHECK_THROWS_AS((void)(survey | stride(2) | crop(part) | take(5)), invalid_input);
  CHECK_THROWS_AS(
      (void)(survey | with_reach(0, [](point_cloud<float, 3> c) { return c; }) | take(5)),
      invalid_input);
  CHECK_THROWS_AS((void)(survey | take(-1)), invalid_input);
  CHECK_THROWS_AS((void)(survey | stride(0)), invalid_input);
  CHECK((survey | stride(2) | crop(part)).read().size() > 0);
  ground.points(1, 4) = std::numeric_limits<float>::quiet_NaN();
  write_ply(ground, folder / "nan.ply");
  const auto with_nan = open_tiles<float>(folder / "nan.ply", {.edge = 20});
  CHECK_THROWS_WITH_AS((void)(with_nan | take(5)), doctest::Contains("where points are not finite"),
                       invalid_input);
  CHECK((with_nan | write_tiles(folder / "out") | take(5)).read().size() == 5);

  // A run is not resumed with another sample.
  const auto run = [&](std::uint64_t seed, bool fails, bool resume) {
    const auto fail = with_reach(0, [fails](point_cloud<float, 3> cloud) {
      if (fails && !cloud.empty() && cloud.points(0, 0) > 40) throw std::runtime_error{"no"};
      return cloud;
    });
    return open_tiles<float>(folder / "ground.ply", {.edge = 10, .threads = 1}) |
           random_sample(300, {.seed = seed}) | fail |
           write_tiles(folder / "sampled", {.resume = resume});
  };
  CHECK_THROWS((void)run(1, true, false));
  CHECK_THROWS_AS((void)run(2, false, true), invalid_input);
  CHECK(run(1, false, true).size() == 300);
}
