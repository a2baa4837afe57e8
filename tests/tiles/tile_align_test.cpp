// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <mutex>
#include <stop_token>
#include <string>
#include <tuple>
#include <vector>

import cilantro;
import test_support;
import rank_support;
import registration_support;
import tile_support;
using namespace cilantro;
namespace fs = std::filesystem;

namespace {

/// Hills that no motion leaves as they are.
template <class S>
point_cloud<S, 3> hills(index_t n, double edge, std::uint64_t seed) {
  point_cloud<S, 3> cloud;
  cloud.points.resize(3, n);
  for (index_t i = 0; i < n; ++i) {
    random_stream random{seed, std::uint64_t(i)};
    const double x = random.uniform(-edge, edge), y = random.uniform(-edge, edge);
    cloud.points.col(i) << S(x), S(y),
        S(2 * std::sin(0.4 * x) + 1.5 * std::cos(0.5 * y + 0.2 * x) + 0.01 * random.normal());
  }
  return cloud;
}

template <class S>
rigid_transform<S, 3> small_motion(double angle, double x, double y, double z) {
  rigid_transform<S, 3> motion = rigid_transform<S, 3>::Identity();
  motion.linear() = Eigen::AngleAxisd{angle, Eigen::Vector3d{1, 2, 3}.normalized()}
                        .toRotationMatrix()
                        .template cast<S>();
  motion.translation() << S(x), S(y), S(z);
  return motion;
}

template <class T>
auto everything(const icp_result<T>& found) {
  return std::tuple{found.status,
                    found.iterations,
                    found.pairs,
                    found.overlap,
                    found.rmse,
                    found.residual,
                    Eigen::MatrixXd{found.transform.matrix()},
                    found.information,
                    found.eigenvalues,
                    found.undetermined};
}

struct scene {
  test::temporary_folder folder;
  point_cloud<double, 3> map = hills<double>(12'000, 30, 1);
  point_cloud<double, 3> scan;
  scene() {
    write_ply(map, folder / "map.ply");
    scan = transform(hills<double>(1500, 9, 2), small_motion<double>(0.03, 0.2, -0.3, 0.1));
    write_ply(scan, folder / "scan.ply");
  }
};

}  // namespace

TEST_CASE("a scan is aligned to a survey as to the same points in memory") {
  const scene s;
  for (const bool by_planes : {true, false})
    for (const bool is_robust : {false, true}) {
      INFO(by_planes, " ", is_robust);
      align_options options{.max_distance = 1.5, .max_iterations = 60};
      if (!by_planes) options.metric = point_to_point{};
      if (is_robust) options.robust = huber{0.05};
      const auto expected = align(s.scan, s.map, options);
      const auto found =
          align(s.scan, open_tiles<double>(s.folder / "map.ply", {.edge = 7}), options);
      CHECK(test::difference(found.transform, expected.transform) < 1e-9);
      CHECK(found.status == expected.status);
      CHECK(found.iterations == expected.iterations);
      CHECK(found.pairs == expected.pairs);
      CHECK(found.overlap == expected.overlap);
      CHECK(found.rmse == doctest::Approx(expected.rmse).epsilon(1e-9));
      CHECK(found.residual == doctest::Approx(expected.residual).epsilon(1e-9));
      CHECK(found.information.isApprox(expected.information, 1e-7));
      CHECK(found.eigenvalues.isApprox(expected.eigenvalues, 1e-7));
      CHECK(found.last_change.translation ==
            doctest::Approx(expected.last_change.translation).epsilon(1e-3));
      const auto fit = evaluate(s.scan, open_tiles<double>(s.folder / "map.ply", {.edge = 11}),
                                found.transform, options);
      CHECK(fit.pairs == found.pairs);
      CHECK(fit.residual == doctest::Approx(found.residual).epsilon(1e-12));
    }
}

TEST_CASE("an alignment has the same bits for any tiles, threads and ranks") {
  const scene s;
  const auto open = [&](const char* name, double edge, int threads) {
    return open_tiles<double>(s.folder / name, {.edge = edge, .threads = threads});
  };
  const align_options options{.max_distance = 1.5, .robust = huber{0.05}};
  const auto expected = everything(align(s.scan, open("map.ply", 1000, 1), options));
  for (const double edge : {6.0, 17.0})
    for (const int threads : {1, 4}) {
      INFO(edge, " ", threads);
      CHECK(everything(align(s.scan, open("map.ply", edge, threads), options)) == expected);
    }
  const auto of_surveys =
      everything(align(open("scan.ply", 1000, 1), open("map.ply", 1000, 1), options));
  CHECK(std::get<6>(of_surveys).isApprox(std::get<6>(expected), 1e-12));
  for (const double edge : {4.0, 30.0})
    CHECK(everything(align(open("scan.ply", edge, 4), open("map.ply", 12, 1), options)) ==
          of_surveys);
  for (const int count : {1, 2, 3, 4}) {
    INFO(count);
    std::mutex mutex;
    test::in_process_ranks job{count};
    job.run([&](auto& world) {
      const auto map = open("map.ply", 10, 2).on(world);
      const auto of_scan = everything(align(s.scan, map, options));
      const auto of_survey = everything(align(open("scan.ply", 5, 1).on(world), map, options));
      const std::scoped_lock lock{mutex};
      CHECK(of_scan == expected);
      CHECK(of_survey == of_surveys);
    });
  }
  // With so little memory that nothing is kept.
  const auto little = open_tiles<double>(s.folder / "map.ply", {.edge = 7, .memory = 4_MB});
  CHECK(everything(align(s.scan, little, options)) == expected);
}

TEST_CASE("normals that a map has are used, and steps see their surroundings") {
  const scene s;
  write_ply(estimate_normals(s.map, knn{20}), s.folder / "normals.ply");
  const align_options options{.max_distance = 2};
  const auto expected = align(s.scan, estimate_normals(s.map, knn{20}), options);
  const auto of_file =
      align(s.scan, open_tiles<double>(s.folder / "normals.ply", {.edge = 8}), options);
  const auto of_step = align(
      s.scan, open_tiles<double>(s.folder / "map.ply", {.edge = 8}) | estimate_normals(knn{20}),
      options);
  CHECK(test::difference(of_file.transform, expected.transform) < 1e-9);
  CHECK(everything(of_file) == everything(of_step));

  const auto steps =
      voxel_downsample(0.5) | remove_statistical_outliers({.neighbors = 8, .deviations = 2});
  const auto thin =
      align(s.scan, open_tiles<double>(s.folder / "map.ply", {.edge = 8}) | steps, options);
  CHECK(test::difference(thin.transform, align(s.scan, s.map | steps, options).transform) < 1e-9);
}

TEST_CASE("floats, two dimensions, and origins far away are aligned") {
  const test::temporary_folder folder;
  auto map = hills<float>(8000, 20, 3);
  auto scan = transform(hills<float>(1000, 8, 4), small_motion<float>(0.02, 0.1, 0.1, 0.05));
  map.origin = Eigen::Vector3d{690'000, 5'330'000, 400};
  scan.origin = map.origin + Eigen::Vector3d{0.25, -0.5, 0};
  write_las(map, folder / "map.las");
  const auto survey = open_tiles<float>(folder / "map.las", {.edge = 9});
  const auto found = align(scan, survey, {.max_distance = 2});
  CHECK(found.converged());
  const auto moved = transform(scan, in_the_world(found, survey));
  CHECK(compare(moved, survey, {.max_distance = 2}).rmse < 0.3);
  // Rounding of the file's millimetres, and of floats.
  const auto expected = align(scan, map, {.max_distance = 2});
  const auto in_world = in_the_world(expected, map);
  CHECK((moved.points.cast<double>().colwise() + moved.full_origin())
            .isApprox(transform(scan, in_world).points.cast<double>().colwise() +
                          transform(scan, in_world).full_origin(),
                      1e-8));

  point_cloud<double, 2> curve, part;
  curve.points.resize(2, 4000);
  for (index_t i = 0; i < 4000; ++i) {
    const double x = double(i) / 100;
    curve.points.col(i) << x, std::sin(x) + 0.3 * std::sin(2.3 * x);
  }
  write_ply(curve, folder / "curve.ply");
  rigid_transform<double, 2> turn = rigid_transform<double, 2>::Identity();
  turn.linear() = Eigen::Rotation2Dd{0.02}.toRotationMatrix();
  turn.translation() << 0.1, -0.2;
  part = transform(curve | take(2500) | stride(3), turn);
  for (const bool by_planes : {true, false}) {
    align_options options{.max_distance = 1, .max_iterations = 200};
    if (!by_planes) options.metric = point_to_point{};
    const auto onto =
        align(part, open_tiles<double, 2>(folder / "curve.ply", {.edge = 3}), options);
    CHECK(test::difference(onto.transform, align(part, curve, options).transform) < 1e-9);
    CHECK(onto.converged());
  }
}

TEST_CASE("what cannot be aligned is told, and bad data is a status") {
  const scene s;
  const auto map = open_tiles<double>(s.folder / "map.ply", {.edge = 10});
  const auto refused = [&](const align_options& options) {
    CHECK_THROWS_AS((void)align(s.scan, map, options), invalid_input);
  };
  refused({});
  refused({.max_distance = 0});
  refused({.metric = symmetric{}, .max_distance = 1});
  refused({.max_distance = 1, .reciprocal = true});
  refused({.max_distance = 1, .one_to_one = sides::target});
  refused({.max_distance = 1, .fraction = 0.5});
  refused({.max_distance = 1, .threads = 2});
  refused({.scales = {{0.5, 1}}});
  refused({.max_distance = 1, .graduation = 2});
  refused({.max_distance = 1, .max_iterations = -1});
  refused(
      {.initial = Eigen::Matrix4d{Eigen::Vector4d{2, 1, 1, 1}.asDiagonal()}, .max_distance = 1});
  CHECK_THROWS_AS(
      (void)align(s.scan, map | transform(small_motion<double>(0, 0, 0, 0)), {.max_distance = 1}),
      invalid_input);

  // No overlap, no points, and a plane, along which nothing is determined.
  auto far = s.scan;
  far.points.array() += 500;
  CHECK(align(far, map, {.max_distance = 1}).status == icp_status::too_few_pairs);
  CHECK(align(point_cloud<double, 3>{}, map, {.max_distance = 1}).status ==
        icp_status::too_few_pairs);
  write_ply(test::terrain<double>(0), s.folder / "none.ply");
  CHECK(align(s.scan, open_tiles<double>(s.folder / "none.ply", {.edge = 1}), {.max_distance = 1})
            .status == icp_status::too_few_pairs);
  auto flat = s.map;
  flat.points.row(2).setZero();
  write_ply(flat, s.folder / "flat.ply");
  auto part = s.scan;
  part.points.row(2).setConstant(0.1);
  part.points(0, 3) = std::numeric_limits<double>::quiet_NaN();
  const auto slides =
      align(part, open_tiles<double>(s.folder / "flat.ply", {.edge = 6}), {.max_distance = 1});
  CHECK(slides.status == icp_status::degenerate);
  CHECK(slides.undetermined == 3);
  CHECK(slides.non_finite == 1);
  CHECK(slides.transform.translation().isApprox(Eigen::Vector3d{0, 0, -0.1}, 1e-9));

  std::stop_source stop;
  stop.request_stop();
  CHECK(align(s.scan, map, {.max_distance = 1, .monitor = {.stop = stop.get_token()}}).status ==
        icp_status::cancelled);
  double share = 0;
  int seen = 0;
  const auto found = align(s.scan, map,
                           {.max_distance = 2,
                            .observer = [&](const align_iteration&) { ++seen; },
                            .monitor = {.progress = [&](double now) { share = now; }}});
  CHECK(share == 1);
  CHECK(seen == found.iterations);
}

TEST_CASE(
    "a stop that one rank is told, or an observer of one that throws, keeps no other waiting") {
  const scene s;
  const align_options options{.max_distance = 1.5};
  for (const int way : {0, 1, 2}) {
    INFO(way);
    std::mutex mutex;
    int cancelled_ones = 0, others = 0;
    test::in_process_ranks job{3};
    const auto work = [&](auto& world) {
      std::stop_source stop;
      auto mine = options;
      if (world.rank() == 1) {
        mine.monitor.stop = stop.get_token();
        if (way == 0) stop.request_stop();
        mine.observer = [&](const align_iteration&) {
          if (way == 1) stop.request_stop();
          if (way == 2) throw std::runtime_error{"seen enough"};
        };
      }
      const auto map = open_tiles<double>(s.folder / "map.ply", {.edge = 10}).on(world);
      bool is_cancelled = false;
      std::string said;
      try {
        is_cancelled = align(s.scan, map, mine).status == icp_status::cancelled;
      } catch (const std::runtime_error& error) {
        said = error.what();
      }
      const std::scoped_lock lock{mutex};
      if (world.rank() == 1) {
        CHECK(is_cancelled == (way < 2));
        cancelled_ones += is_cancelled;
      } else {
        CHECK(said.find("rank 1: ") == 0);
        ++others;
      }
    };
    job.run(work);
    CHECK(others == 2);
    CHECK(cancelled_ones == (way < 2));
  }
}

TEST_CASE("figures of an alignment that was stopped are none") {
  const scene s;
  const auto map = open_tiles<double>(s.folder / "map.ply", {.edge = 10});
  std::stop_source stop;
  stop.request_stop();
  CHECK_THROWS_AS((void)evaluate(s.scan, map, Eigen::Isometry3d::Identity(),
                                 {.max_distance = 1.5, .monitor = {.stop = stop.get_token()}}),
                  cancelled);
}

TEST_CASE("what is read of a target is in the budget, wherever the source is moved to") {
  const test::temporary_folder folder;
  point_cloud<float, 3> dense;
  dense.points.resize(3, 200'000);
  random_stream random{3};
  for (index_t i = 0; i < dense.size(); ++i)
    dense.points.col(i) << random.uniform(1, 10), random.uniform(1, 10), random.uniform();
  dense.points.col(7) << 90, 90, 0;
  write_ply(dense, folder / "dense.ply");
  rigid_transform<float, 3> away = rigid_transform<float, 3>::Identity();
  away.translation()[0] = -400;
  write_ply(transform(dense | take(2000) | stride(50), away), folder / "beside.ply");
  align_options options{.metric = point_to_point{}, .max_distance = 1, .max_iterations = 1};
  for (const double edge : {50.0, 1000.0}) {
    const auto target = open_tiles<float>(folder / "dense.ply", {.edge = edge, .memory = 1_GB});
    const auto source = [&](std::uint64_t memory) {
      return open_tiles<float>(folder / "beside.ply", {.edge = 100, .memory = memory});
    };
    options.initial = {};
    CHECK(align(source(40_MB), target, options).pairs == 0);
    options.initial = any_transform{rigid_transform<float, 3>{away.inverse()}};
    CHECK(align(source(100_MB), target, options).pairs == 40);
    // 200,000 points take more than 50 MB while they are searched.
    CHECK_THROWS_AS((void)align(source(40_MB), target, options), invalid_input);
  }
}
