// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <vector>

import cilantro;
import test_support;
import rank_support;
import tile_support;
using namespace cilantro;
using test::terrain;
namespace fs = std::filesystem;

namespace {

/// By all pairs, in double; in plain arithmetic, which is fast without optimisation, too.
template <class S>
std::vector<double> nearest_distances(const point_cloud<S, 3>& from, const point_cloud<S, 3>& to) {
  std::vector<double> all;
  const Eigen::Matrix3Xd sources = from.points.template cast<double>();
  const Eigen::Matrix3Xd targets = to.points.template cast<double>();
  for (const double *p = sources.data(), *end = p + sources.size(); p != end; p += 3) {
    double least = std::numeric_limits<double>::infinity();
    for (const double *q = targets.data(), *last = q + targets.size(); q != last; q += 3) {
      const double x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
      const double squared = x * x + y * y + z * z;
      if (squared < least) least = squared;
    }
    all.push_back(std::sqrt(least));
  }
  return all;
}

std::vector<double> figures(const comparison& found) {
  return {double(found.points), double(found.pairs), found.overlap,
          found.mean,           found.rmse,          found.maximum};
}

}  // namespace

TEST_CASE_TEMPLATE("surveys are compared as by all pairs, for any tiles, threads and ranks", S,
                   float, double) {
  const test::temporary_folder folder;
  const auto before = terrain<S>(4000, 1), after = terrain<S>(3000, 2);
  write_ply(before, folder / "before.ply");
  write_ply(after, folder / "after.ply");
  const double limit = 1.5;
  index_t pairs = 0;
  double sum = 0, squares = 0, most = 0;
  for (const double d : nearest_distances(after, before)) {
    if (d > limit) continue;
    ++pairs;
    sum += d;
    squares += d * d;
    most = std::max(most, d);
  }
  const auto open = [&](const char* name, double edge, int threads) {
    return open_tiles<S>(folder / name, {.edge = edge, .threads = threads});
  };
  const auto found =
      compare(open("after.ply", 20, 1), open("before.ply", 20, 1), {.max_distance = limit});
  CHECK(found.points == 3000);
  CHECK(found.pairs == pairs);
  CHECK(found.overlap == double(pairs) / 3000);
  CHECK(found.mean == doctest::Approx(sum / double(pairs)).epsilon(1e-12));
  CHECK(found.rmse == doctest::Approx(std::sqrt(squares / double(pairs))).epsilon(1e-12));
  CHECK(found.maximum == doctest::Approx(most).epsilon(1e-15));

  const auto expected = figures(found);
  for (const double edge : {5.0, 30.0, 1000.0})
    for (const double other : {4.0, 29.0, 500.0})
      for (const int threads : {1, 4}) {
        INFO(edge, " ", other, " ", threads);
        CHECK(figures(compare(open("after.ply", edge, threads), open("before.ply", other, 1),
                              {.max_distance = limit})) == expected);
      }
  for (const double edge : {5.0, 40.0})
    CHECK(figures(compare(after, open("before.ply", edge, 4), {.max_distance = limit})) ==
          expected);
  for (const int count : {1, 2, 3, 4}) {
    INFO(count);
    std::mutex mutex;
    test::in_process_ranks job{count};
    job.run([&](auto& world) {
      const auto shared = open("before.ply", 13, 1).on(world);
      const auto of_survey =
          compare(open("after.ply", 10, 2).on(world), shared, {.max_distance = limit});
      const auto of_cloud = compare(after, shared, {.max_distance = limit});
      const std::scoped_lock lock{mutex};
      CHECK(figures(of_survey) == expected);
      CHECK(figures(of_cloud) == expected);
    });
  }
}

TEST_CASE_TEMPLATE("distances are written as an attribute, also where points have moved", S, float,
                   double) {
  const test::temporary_folder folder;
  const auto before = terrain<S>(4000, 1);
  auto after = terrain<S>(3000, 2);
  write_ply(before, folder / "before.ply");
  write_ply(after, folder / "after.ply");
  const auto target = open_tiles<S>(folder / "before.ply", {.edge = 12}) | voxel_downsample(0.7) |
                      remove_statistical_outliers({.neighbors = 6, .deviations = 3});
  const auto whole_target = before | voxel_downsample(0.7) |
                            remove_statistical_outliers({.neighbors = 6, .deviations = 3});
  const auto step = distances_to(target, {.max_distance = 2});
  const auto check = [&](const point_cloud<S, 3>& found) {
    const auto distances = nearest_distances(found, whole_target);
    const auto written = found.template attribute_as<S>("distance");
    index_t far = 0;
    for (index_t i = 0; i < found.size(); ++i) {
      CHECK(double(written[i]) == doctest::Approx(std::min(distances[i], 2.0)).epsilon(1e-6));
      far += written[i] == S(2) ? 1 : 0;
    }
    CHECK(far > 0);
    CHECK(far < found.size());
  };
  const auto survey = open_tiles<S>(folder / "after.ply", {.edge = 15});
  check((survey | step).read());
  test::check_same((survey | step).read(), after | step);

  rigid_transform<S, 3> turn = rigid_transform<S, 3>::Identity();
  turn.linear() = Eigen::AngleAxis<S>{S(0.4), Eigen::Matrix<S, 3, 1>{0, 0, 1}}.toRotationMatrix();
  turn.translation() << S(3), S(-8), S(0.1);
  check((survey | transform(turn) | step).read());
  const auto moved = compare(survey | transform(turn), target, {.max_distance = 2});
  CHECK(figures(moved) == figures(compare(transform(after, turn), target, {.max_distance = 2})));
}

TEST_CASE("origins that differ are what distances are between") {
  const test::temporary_folder folder;
  point_cloud<float, 3> a, b;
  a.points.resize(3, 2);
  a.points << 0, 1, 0, 0, 0, 0;
  b = a;
  a.origin = Eigen::Vector3d{690'000, 5'330'000, 400};
  b.origin = Eigen::Vector3d{690'000, 5'330'002, 400};
  write_las(a, folder / "a.las");
  write_las(b, folder / "b.las");
  const auto target = open_tiles<float>(folder / "b.las", {.edge = 1});
  for (const auto& found :
       {compare(a, target, {.max_distance = 3}),
        compare(open_tiles<float>(folder / "a.las", {.edge = 2}), target, {.max_distance = 3})}) {
    CHECK(found.pairs == 2);
    CHECK(found.maximum == doctest::Approx(2).epsilon(1e-9));
  }
}

TEST_CASE("what cannot be compared is told, and nothing is compared as nothing") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(0), folder / "none.ply");
  write_ply(terrain<float>(1), folder / "one.ply");
  write_ply(terrain<float>(2000), folder / "many.ply");
  const auto none = open_tiles<float>(folder / "none.ply", {.edge = 5});
  const auto one = open_tiles<float>(folder / "one.ply", {.edge = 5});
  const auto many = open_tiles<float>(folder / "many.ply", {.edge = 5});
  CHECK(figures(compare(none, many, {.max_distance = 1})) == std::vector<double>(6));
  CHECK(figures(compare(many, none, {.max_distance = 1})) ==
        std::vector<double>{2000, 0, 0, 0, 0, 0});
  CHECK(compare(one, one, {.max_distance = 1}).pairs == 1);

  auto cloud = terrain<float>(10);
  cloud.points(1, 4) = std::numeric_limits<float>::quiet_NaN();
  CHECK(compare(cloud, many, {.max_distance = 1e9}).points == 9);
  CHECK(compare(cloud, many, {.max_distance = 1e9}).pairs == 9);
  const auto step = distances_to(many, {.max_distance = 9, .attribute = "change"});
  CHECK(std::isnan((cloud | step).attribute_as<float>("change")[4]));

  CHECK_THROWS_AS((void)compare(one, many, {.max_distance = 0}), invalid_input);
  CHECK_THROWS_AS((void)compare(one, many, {.max_distance = std::nan("")}), invalid_input);
  const auto moving =
      many | transform(rigid_transform<float, 3>{rigid_transform<float, 3>::Identity()});
  CHECK_THROWS_WITH((void)compare(one, moving, {.max_distance = 1}),
                    doctest::Contains("which moves points"));
  std::stop_source stop;
  stop.request_stop();
  CHECK_THROWS_AS(
      (void)compare(many, many, {.max_distance = 1, .monitor = {.stop = stop.get_token()}}),
      cancelled);
  double share = 0;
  (void)compare(many | remove_statistical_outliers(), many | remove_statistical_outliers(),
                {.max_distance = 1, .monitor = {.progress = [&](double now) {
                                      CHECK(now >= share);
                                      share = now;
                                    }}});
  CHECK(share == 1);
}

TEST_CASE("what is read of a target is in the budget, wherever it is dense") {
  const test::temporary_folder folder;
  // The first square of 50 has nearly all points, and the middle of the tile of 100 has few.
  point_cloud<float, 3> dense;
  dense.points.resize(3, 200'000);
  random_stream random{3};
  for (index_t i = 0; i < dense.size(); ++i)
    dense.points.col(i) << random.uniform(1, 10), random.uniform(1, 10), random.uniform();
  dense.points.col(7) << 90, 90, 0;
  write_ply(dense, folder / "dense.ply");
  const auto sparse = dense | take(2000) | stride(100);
  write_ply(sparse, folder / "sparse.ply");
  write_ply(transform(sparse, rigid_transform<float, 3>{Eigen::Translation3f{-400, 0, 0}}),
            folder / "beside.ply");
  const auto survey = [&](const char* name, std::uint64_t memory) {
    return open_tiles<float>(folder / name, {.edge = 100, .memory = memory});
  };
  rigid_transform<float, 3> back = rigid_transform<float, 3>::Identity();
  back.translation()[0] = 400;
  const compare_options near{.max_distance = 1};
  const auto difference = compare(sparse, survey("dense.ply", 1_GB), near);
  // 200,000 points take more than 50 MB while they are searched.
  for (const double edge : {50.0, 1000.0}) {
    const auto target = open_tiles<float>(folder / "dense.ply", {.edge = edge, .memory = 1_GB});
    const auto changes = distances_to(target, {.max_distance = 1});
    CHECK(figures(compare(survey("sparse.ply", 100_MB), target, near)) == figures(difference));
    CHECK((survey("sparse.ply", 100_MB) | changes).read().size() == sparse.size());
    CHECK((survey("beside.ply", 100_MB) | transform(back) | changes).read().size() ==
          sparse.size());
    CHECK_THROWS_AS((void)compare(survey("sparse.ply", 40_MB), target, near), invalid_input);
    CHECK_THROWS_AS((void)compare(survey("beside.ply", 40_MB) | transform(back), target, near),
                    invalid_input);
    CHECK_THROWS_AS((void)(survey("sparse.ply", 40_MB) | changes).read(), invalid_input);
    CHECK_THROWS_AS((void)(survey("beside.ply", 40_MB) | transform(back) | changes).read(),
                    invalid_input);
    // Where the points are, there is nothing to read.
    CHECK(compare(survey("beside.ply", 40_MB), target, near).pairs == 0);
    CHECK((survey("beside.ply", 40_MB) | changes).read().size() == sparse.size());
  }
}

TEST_CASE("a distance without a limit reads all of the target, which is in the budget") {
  const test::temporary_folder folder;
  auto cloud = terrain<float>(200'000);
  write_ply(cloud, folder / "target.ply");
  cloud = cloud | stride(1000);
  // Beyond what numbers of squares can be.
  cloud.points.col(0) << 1e25f, 0, 0;
  for (const double distance : {1e30, std::numeric_limits<double>::max()}) {
    const auto pairs = [&](std::uint64_t memory) {
      return compare(cloud,
                     open_tiles<float>(folder / "target.ply", {.edge = 50, .memory = memory}),
                     {.max_distance = distance})
          .pairs;
    };
    CHECK(pairs(1_GB) == cloud.size());
    CHECK_THROWS_AS((void)pairs(40_MB), invalid_input);
  }
}

TEST_CASE("a run is not resumed with another target, distance or attribute") {
  const test::temporary_folder folder;
  const auto ground = terrain<float>(3000), before = terrain<float>(2000, 2);
  write_ply(ground, folder / "ground.ply");
  const auto write_target = [&](float x) {
    fs::remove_all(folder / "target");
    write_ply(transform(before, rigid_transform<float, 3>{Eigen::Translation3f{x, 0, 0}}),
              folder / "target.ply");
    (void)(open_tiles<float>(folder / "target.ply", {.edge = 500}) |
           write_tiles(folder / "target"));
  };
  const auto run = [&](bool fails, double distance, const std::string& name, bool resume) {
    const auto target = open_tiles<float>(folder / "target");
    const auto fail = with_reach(0, [fails](point_cloud<float, 3> cloud) {
      if (fails && !cloud.empty() && cloud.points(0, 0) > 40) throw std::runtime_error{"no"};
      return cloud;
    });
    return open_tiles<float>(folder / "ground.ply", {.edge = 10, .threads = 1}) |
           distances_to(target, {.max_distance = distance, .attribute = name}) | fail |
           write_tiles(folder / "out", {.resume = resume});
  };
  write_target(0);
  CHECK_THROWS((void)run(true, 2, "change", false));
  CHECK_THROWS_AS((void)run(false, 3, "change", true), invalid_input);
  CHECK_THROWS_AS((void)run(false, 2, "distance", true), invalid_input);
  // As many points and bytes as before, elsewhere.
  write_target(1);
  CHECK_THROWS_WITH((void)run(false, 2, "change", true),
                    doctest::Contains("was begun with other files, steps or options"));
  write_target(0);
  const auto found = run(false, 2, "change", true).read();
  test::check_same(found, ground | distances_to(open_tiles<float>(folder / "target"),
                                                {.max_distance = 2, .attribute = "change"}));
}

TEST_CASE("distances_to is watched") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(2000), folder / "many.ply");
  const auto many = open_tiles<float>(folder / "many.ply", {.edge = 5});
  double share = 0;
  std::stop_source stop;
  const auto step =
      distances_to(many | remove_statistical_outliers(), {.max_distance = 1,
                                                          .monitor = {.progress =
                                                                          [&](double now) {
                                                                            CHECK(now >= share);
                                                                            share = now;
                                                                          },
                                                                      .stop = stop.get_token()}});
  CHECK(share == 1);
  stop.request_stop();
  CHECK_THROWS_AS((void)(terrain<float>(20) | step), cancelled);
  CHECK_THROWS_AS((void)distances_to(many | remove_statistical_outliers(),
                                     {.max_distance = 1, .monitor = {.stop = stop.get_token()}}),
                  cancelled);
}
