// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdint>
#include <ranges>
#include <sstream>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

point_cloud<float, 3> some_cloud(index_t count = 500, std::uint64_t seed = 1) {
  return {.points = test::random_points<test::f3>(count, seed)};
}

}  // namespace

static_assert(StepFor<decltype([](point_cloud<float, 3> c) { return c; }), point_cloud<float, 3>>);
static_assert(!StepFor<decltype([](int i) { return i; }), point_cloud<float, 3>>);
static_assert(!StepFor<decltype([](auto c) { return c; }), int>);

TEST_CASE("a piped step is the function of the same name") {
  const auto cloud = some_cloud();
  CHECK((cloud | voxel_downsample(0.3)) == voxel_downsample(cloud, 0.3));
  CHECK((cloud | estimate_normals(knn{8})) == estimate_normals(cloud, knn{8}));
  CHECK((cloud | remove_invalid()) == remove_invalid(cloud));
  CHECK((cloud | select(std::vector{3, 5})) == select(cloud, std::vector{3, 5}));
  CHECK((cloud | append(cloud)) == append(cloud, cloud));
  CHECK((cloud | cast<double>()) == cast<double>(cloud));
  const Eigen::Isometry3f by{Eigen::AngleAxisf{1, Eigen::Vector3f::UnitX()}};
  CHECK((cloud | transform(by)) == transform(cloud, by));
  const auto oriented = estimate_normals(cloud, knn{8});
  CHECK((oriented | orient_to_viewpoint({0, 0, 9})) == orient_to_viewpoint(oriented, {0, 0, 9}));
}

TEST_CASE("a temporary cloud is moved through a whole pipeline, never copied") {
  auto cloud = some_cloud();
  const float* memory = cloud.points.data();
  test::temporary_folder folder;
  pipeline_report report;
  const auto result = std::move(cloud) | remove_invalid() | report_to(report, "valid") |
                      estimate_normals(knn{5}) | transform(Eigen::Isometry3f::Identity()) |
                      orient_to_viewpoint({0, 0, 1}) | write_ply(folder / "out.ply");
  CHECK(result.points.data() == memory);
}

TEST_CASE("a matrix of homogeneous coordinates is a transform") {
  const auto cloud = some_cloud();
  Eigen::Isometry3d by{Eigen::AngleAxisd{1, Eigen::Vector3d::UnitX()}};
  by.translation() = Eigen::Vector3d{1, 2, 3};
  CHECK((cloud | transform(by.matrix())) == transform(cloud, Eigen::Affine3d{by}));
  const Eigen::Matrix4f in_float = by.matrix().cast<float>();
  CHECK(transform(cloud, in_float) == transform(cloud, Eigen::Affine3f{in_float}));
  Eigen::Matrix4d perspective = by.matrix();
  perspective(3, 0) = 0.1;
  CHECK_THROWS_AS((void)transform(cloud, perspective), invalid_input);
}

TEST_CASE("a lambda is a step behind a cloud and behind a step") {
  const auto cloud = some_cloud();
  const auto first_ten = [](auto c) { return select(c, std::views::iota(0, 10)); };
  CHECK((cloud | first_ten) == (cloud | step{first_ten}));
  const auto line = remove_invalid() | first_ten | transform(Eigen::Isometry3f::Identity());
  CHECK((cloud | line) == (cloud | first_ten));
  CHECK((some_cloud() | [](point_cloud<float, 3>&& c) { return c.size(); }) == 500);
}

TEST_CASE("a cloud that has a name is left as it is") {
  const auto cloud = some_cloud();
  const auto before = cloud;
  const auto result = cloud | transform(Eigen::Isometry3f{Eigen::Translation3f{1, 2, 3}}) |
                      estimate_normals(knn{5});
  CHECK(cloud == before);
  CHECK(result.has_normals());
}

TEST_CASE("steps compose into a step that can be stored, copied and used again") {
  const auto prepare = voxel_downsample(0.2) | estimate_normals(knn{8}, {.viewpoint = {{0, 0, 5}}});
  const auto same = prepare;
  const auto a = some_cloud(400, 1), b = some_cloud(400, 2);
  const auto by_hand = [](const auto& c) {
    return estimate_normals(voxel_downsample(c, 0.2), knn{8}, {.viewpoint = {{0, 0, 5}}});
  };
  CHECK((a | prepare) == by_hand(a));
  CHECK((b | same) == by_hand(b));
  CHECK((a | (prepare | remove_invalid())) == (a | prepare | remove_invalid()));
}

TEST_CASE("a stored step maps frames in the standard views") {
  const std::vector frames{some_cloud(100, 1), some_cloud(200, 2), some_cloud(0, 3)};
  const auto prepare = voxel_downsample(0.4) | estimate_normals(knn{6});
  std::size_t i = 0;
  for (const auto& cloud : frames | std::views::transform(prepare))
    CHECK(cloud == (frames[i++] | prepare));
  CHECK(i == 3);
}

TEST_CASE("a user's own step is a lambda wrapped once") {
  const auto flatten = step{[](auto cloud) {
    cloud.points.row(2).setZero();
    return cloud;
  }};
  const auto flat = some_cloud() | flatten | voxel_downsample(0.5);
  CHECK(flat.points.row(2).isZero(0));
  // It may also end the pipeline with something else than a cloud.
  const auto count = step{[](const auto& cloud) { return cloud.size(); }};
  CHECK((some_cloud(77) | (remove_invalid() | count)) == 77);
}

TEST_CASE("one step serves clouds of any scalar and dimension") {
  const auto halve = select([](index_t i) { return i % 2 == 0; });
  CHECK((some_cloud(10) | halve).size() == 5);
  const point_cloud<double, 2> flat{.points = test::random_points<test::d2>(7)};
  CHECK((flat | halve | voxel_downsample(100)).size() <= 4);
  const point_cloud<double, dynamic> high{.points = test::random_points<test::dx>(7)};
  CHECK((high | halve).dimension() == 4);
}

TEST_CASE_TEMPLATE(
    "clouds of no point, one point, equal points or only invalid ones pass every step", T,
    ALL_SPACES) {
  using S = typename T::scalar;
  using matrix = point_matrix<S, T::static_dimension>;
  const coordinates eye = Eigen::VectorXd::Ones(T::dimension).eval();
  const auto all = remove_invalid() | voxel_downsample(0.1) | estimate_normals(knn{8}) |
                   orient_to_viewpoint(eye) | select([](index_t) { return true; }) | cast<float>() |
                   cast<S>();
  const auto size_after = [&](const matrix& points) {
    const auto result = point_cloud<S, T::static_dimension>{.points = points} | all;
    CHECK(result.points.allFinite());
    CHECK(result.normals.isZero(0));  // None of them determines a normal.
    CHECK(append(result, result).size() == 2 * result.size());
    return result.size();
  };
  CHECK(size_after(matrix(T::dimension, 0)) == 0);
  CHECK(size_after(matrix::Constant(T::dimension, 1, S(0.55))) == 1);
  CHECK(size_after(matrix::Constant(T::dimension, 50, S(0.55))) == 1);
  CHECK(size_after(matrix::Constant(T::dimension, 50, test::nan<S>)) == 0);
  CHECK(size_after(matrix::Constant(T::dimension, 50, -test::infinity<S>)) == 0);
}

TEST_CASE("a report has a line a stage, with the points that went in and out") {
  auto cloud = some_cloud(100);
  cloud.points(1, 7) = test::nan<float>;
  cloud.points(2, 8) = test::infinity<float>;
  pipeline_report report;
  (void)(std::move(cloud) | report_to(report, "read") | remove_invalid() |
         report_to(report, "remove invalid") | select([](index_t i) { return i < 50; }) |
         report_to(report, "first half"));
  REQUIRE(report.stages().size() == 3);
  const auto& [read, removed, half] =
      std::tie(report.stages()[0], report.stages()[1], report.stages()[2]);
  CHECK((read.points_in == 100 && read.points_out == 100 && read.invalid_dropped == 0));
  CHECK((removed.points_in == 100 && removed.points_out == 98 && removed.invalid_dropped == 2));
  CHECK((half.points_in == 98 && half.points_out == 50 && half.invalid_dropped == 0));
  for (const auto& stage : report.stages()) CHECK(stage.milliseconds >= 0);

  std::ostringstream out;
  out << report;
  const std::string table = out.str();
  CHECK(std::ranges::count(table, '\n') == 4);
  CHECK(table.find("remove invalid") != std::string::npos);
  std::vector<std::size_t> widths;
  for (const auto line : std::views::split(table, '\n'))
    if (const auto width = std::ranges::distance(line); width > 0)
      widths.push_back(std::size_t(width));
  CHECK(std::ranges::all_of(widths, [&](std::size_t w) { return w == widths.front(); }));
}
