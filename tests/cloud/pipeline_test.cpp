// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
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

// Steps are values, and say for which clouds they are.
using line_of_steps = decltype(remove_invalid() | voxel_downsample(0.1) |
                               estimate_normals(knn{8}, minimum_covariance_determinant{}) |
                               orient_to_viewpoint({0, 0, 1}) | write_ply("out.ply"));
static_assert(std::copyable<line_of_steps>);
static_assert(std::copyable<decltype(step{[big = std::array<int, 9>{}](auto c) { return c; }})>);
static_assert(StepFor<line_of_steps, point_cloud<float, 3>&>);
static_assert(StepFor<line_of_steps, point_cloud<double, 2>>);
static_assert(!StepFor<line_of_steps, point_cloud<double, dynamic>>);  // No file holds them.
static_assert(!StepFor<decltype(append(point_cloud<float, 3>{})), point_cloud<double, 3>>);
static_assert(
    ChoosingStep<decltype(remove_invalid() | take(3) | stride(2)), point_cloud<float, 3>>);
static_assert(!ChoosingStep<line_of_steps, point_cloud<float, 3>>);
static_assert(!StepFor<decltype(transform(Eigen::Isometry2d{})), point_cloud<double, 3>>);
static_assert(!AffineMap<Eigen::Transform<double, 3, Eigen::Projective>>);

namespace {

// A cloud with all that a cloud can have, of which some points are not finite.
point_cloud<float, 3> rich_cloud(index_t count = 500) {
  auto cloud = estimate_normals(some_cloud(count), knn{6});
  cloud.colors = Eigen::Matrix3Xf::Random(3, count).cwiseAbs();
  cloud.set_attribute("id", std::views::iota(0, int(count)));
  cloud.origin = {10, 20, 30};
  for (index_t i = 0; i < count; i += 7) cloud.points(i % 3, i) = test::nan<float>;
  return cloud;
}

}  // namespace

TEST_CASE("steps that choose, in one pass, leave what they leave one after the other") {
  const auto cloud = rich_cloud();
  const auto a = remove_invalid();
  const auto b = crop(box{.lower = {9.5, 19, 29}, .upper = {11, 21, 30.8}});
  const auto c = select([](index_t i) { return i % 3 != 1; });
  const auto d = stride(2);
  const auto e = exclude(std::vector{0, 4});
  const auto f = select(std::vector{5, 3, 3, 0});
  const auto one_by_one = cloud | a | b | c | d | e;
  CHECK((one_by_one.size() > 20 && one_by_one.size() < 200));
  CHECK((cloud | (a | b | c | d | e)) == one_by_one);
  CHECK((cloud | (a | b | c | d | e | f)) == (one_by_one | f));
  CHECK((cloud | ((a | b) | (c | (d | e)))) == one_by_one);
  auto copy = cloud;
  CHECK((std::move(copy) | (a | b | c | d | e)) == one_by_one);
  CHECK((cloud | (a | estimate_normals(knn{5}) | c | d | e)) ==
        (cloud | a | estimate_normals(knn{5}) | c | d | e));
  index_list removed, removed_alone;
  const auto outliers = remove_statistical_outliers({.neighbors = 5, .deviations = 1}, &removed);
  const auto rest = cloud | (a | d | outliers | take(50));
  CHECK(rest == (cloud | a | d |
                 remove_statistical_outliers({.neighbors = 5, .deviations = 1}, &removed_alone) |
                 take(50)));
  CHECK(removed == removed_alone);
  CHECK((cloud | (a | farthest_point_sample(9) | random_sample(5, {.seed = 3}))) ==
        (cloud | a | farthest_point_sample(9) | random_sample(5, {.seed = 3})));
}

TEST_CASE("a temporary cloud loses points in its own memory as a copy would lose them") {
  auto cloud = rich_cloud(1000);
  const auto expected = remove_invalid(cloud);
  const auto result = std::move(cloud) | remove_invalid() | exclude(std::vector{1, 2, 3});
  CHECK(result == exclude(expected, std::vector{1, 2, 3}));
}

TEST_CASE(
    "a cloud is cropped in the world, by boxes, balls, cylinders, half-spaces and predicates") {
  auto cloud = rich_cloud();
  const auto kept_by = [&](const auto& region, const auto& contains) {
    const auto cropped = crop(cloud, region);
    const auto others = remove_inside(cloud, region);
    CHECK((cropped.size() > 10 && others.size() > 10));
    index_t inside = 0, outside = 0;
    for (index_t i = 0; i < cloud.size(); ++i) {
      if (!is_finite(cloud.points.col(i))) continue;
      const Eigen::Vector3d p = cloud.points.col(i).cast<double>() + cloud.origin;
      if (contains(p))
        CHECK(cropped.points.col(inside++) == cloud.points.col(i));
      else
        CHECK(others.points.col(outside++) == cloud.points.col(i));
    }
    CHECK((inside == cropped.size() && outside == others.size()));
    CHECK((cloud | crop(region)) == cropped);
  };
  kept_by(box{.lower = {9, 20, 29}, .upper = {11, 21, 31}},
          [](const auto& p) { return p.y() >= 20; });
  kept_by(ball{.center = {10, 20, 30}, .radius = 0.9}, [](const auto& p) {
    return (p - Eigen::Vector3d{10, 20, 30}).squaredNorm() <= 0.9 * 0.9;
  });
  kept_by(cylinder{.base = {10, 20, 29.5}, .top = {10, 20, 30.5}, .radius = 0.9},
          [](const auto& p) {
            return std::abs(p.z() - 30) <= 0.5 && std::hypot(p.x() - 10, p.y() - 20) <= 0.9;
          });
  kept_by(half_space{.normal = {0, 0, 2}, .offset = 60.5},
          [](const auto& p) { return p.z() <= 30.25; });
  kept_by(
      half_spaces{{{.normal = {1, 0, 0}, .offset = 10.5}, {.normal = {-1, 0, 0}, .offset = -9.8}}},
      [](const auto& p) { return p.x() <= 10.5 && p.x() >= 9.8; });
  kept_by([](const Eigen::Vector3d& p) { return p.x() > 10.1; },
          [](const auto& p) { return p.x() > 10.1; });
}

TEST_CASE("regions that make no sense for the points are refused") {
  const auto cloud = some_cloud();
  CHECK_THROWS_AS((void)crop(cloud, box{{0, 0}, {1, 1}}), invalid_input);
  CHECK_THROWS_AS((void)crop(cloud, box{{0, 0, 0}, {1, -1, 1}}), invalid_input);
  CHECK_THROWS_AS((void)crop(cloud, box{{0, 0, test::nan<double>}, {1, 1, 1}}), invalid_input);
  CHECK_THROWS_AS((void)crop(cloud, ball{{0, 0}, 1}), invalid_input);
  CHECK_THROWS_AS((void)crop(cloud, half_space{{0, 0, 0}, 1}), invalid_input);
  CHECK_THROWS_AS((void)crop(cloud, half_space{{0, 1, 0}, test::nan<double>}), invalid_input);
  CHECK_THROWS_AS((void)box({{0, 0}, {1, 1}}).contains(Eigen::Vector3d{0, 0, 0}), invalid_input);
  CHECK_THROWS_AS((void)(cloud | take(-1)), invalid_input);
  CHECK_THROWS_AS((void)(cloud | stride(0)), invalid_input);
  CHECK(crop(cloud, half_spaces{}) == cloud);
  CHECK(take(cloud, 9) == select(cloud, std::views::iota(0, 9)));
  CHECK(take(cloud, 1000) == cloud);
  CHECK(stride(cloud, 100) == select(cloud, std::vector{0, 100, 200, 300, 400}));
}

TEST_CASE("choices work on points alone as they do on clouds") {
  const auto cloud = rich_cloud();
  const auto even = [](index_t i) { return i % 2 == 0; };
  CHECK(select(cloud.points, std::vector{7, 8, 8}).rightCols(1) == cloud.points.col(8));
  CHECK(remove_invalid(cloud.points) == remove_invalid(cloud).points);
  const std::vector<Eigen::Vector2d> corners{{0, 0}, {1, 0}, {0, 1}, {1, 1}};
  CHECK(select(corners, even) == (Eigen::Matrix2d{} << 0, 0, 0, 1).finished());
  CHECK(exclude(corners, even) == (Eigen::Matrix2d{} << 1, 1, 0, 1).finished());
  CHECK(crop(corners, ball{{0.0, 0.0}, 1}).cols() == 3);
  CHECK_THROWS_AS((void)select(corners, std::vector{4}), invalid_input);
}

TEST_CASE("a step can be asked for its name, its needs and how far it looks") {
  CHECK(name_of(remove_invalid() | voxel_downsample(0.1)) == "remove_invalid | voxel_downsample");
  CHECK(name_of(crop(ball{{0, 0, 0}, 1})) == "crop");
  CHECK(name_of(step{[](auto c) { return c; }}) == "step");
  CHECK(needs_of(orient_to_viewpoint({0, 0, 1})).normals);
  CHECK(!needs_of(estimate_normals(knn{8}) | orient_to_viewpoint({0, 0, 1})).normals);
  CHECK(gives_of(remove_invalid() | estimate_normals(knn{8})).normals);
  CHECK(reach_of(remove_invalid() | crop(ball{{0, 0, 0}, 1})) == step_reach{});
  CHECK(
      reach_of(estimate_normals(radius{0.2}) | remove_radius_outliers({.radius = 0.3}))->distance ==
      doctest::Approx(0.5));
  CHECK(reach_of(estimate_normals(knn{8}))->neighbors == 8);
  CHECK(!reach_of(estimate_normals(knn{8}))->everything);
  CHECK(reach_of(estimate_normals(knn{8}) | estimate_normals(knn{9}))->everything);
  CHECK(reach_of(random_sample(3))->everything);
  CHECK(!reach_of(step{[](auto c) { return c; }}).has_value());
  CHECK(!reach_of(remove_invalid() | [](auto c) { return c; }).has_value());
}

namespace {

struct count_calls {
  int* calls;
  static step_reach reach() { return {}; }
  void choose(const point_cloud<float, 3>&, chosen_points&) const { ++*calls; }
};

}  // namespace

TEST_CASE("a line says before it begins that the cloud lacks what it needs") {
  int begun = 0;
  const auto counted = remove_invalid() | choosing_step{count_calls{&begun}};
  const auto line = counted | orient_to_viewpoint({0, 0, 1});
  CHECK_THROWS_AS((void)(some_cloud() | line), invalid_input);
  CHECK(begun == 0);
  CHECK((rich_cloud() | line).has_normals());
  CHECK((point_cloud<float, 3>{} | line).empty());
}

TEST_CASE("what a lambda in a line needs and gives is not guessed") {
  const auto normals = [](auto cloud) { return estimate_normals(std::move(cloud), knn{10}); };
  const auto line = remove_invalid() | normals | orient_to_viewpoint({0, 0, 2});
  CHECK((some_cloud() | line).has_normals());
  CHECK(!needs_of(line).normals);
}

namespace {

// A step of a user that derives from nothing.
struct halving {
  static constexpr const char* name = "halving";
  static step_reach reach() { return {.distance = 3}; }
  static cloud_parts gives() { return {.colors = true}; }
  void choose(const point_cloud<float, 3>&, chosen_points& kept) const {
    kept.keep_if([](index_t k, std::int32_t) { return k % 2 == 0; });
  }
  point_cloud<float, 3> operator()(const point_cloud<float, 3>& cloud) const {
    return select(cloud, [](index_t i) { return i % 2 == 0; });
  }
};

}  // namespace

TEST_CASE("what a struct says of itself is heard, wrapped or not") {
  const auto line = remove_invalid() | halving{};
  CHECK(name_of(line) == "remove_invalid | halving");
  CHECK(reach_of(line)->distance == 3);
  CHECK(gives_of(line).colors);
  static_assert(ChoosingStep<decltype(line), point_cloud<float, 3>>);
  CHECK((some_cloud() | line) == (some_cloud() | halving{}));
}

TEST_CASE("steps of lambdas can be assigned") {
  const auto cloud = some_cloud();
  const auto beyond = [&cloud](float x) {
    return select([&cloud, x](index_t i) { return cloud.points(0, i) > x; });
  };
  auto choice = beyond(0);
  const auto before = (cloud | choice).size();
  choice = beyond(0.5f);
  CHECK((cloud | choice).size() < before);
  const auto above = [](const auto& p) { return p.z() > 0; };
  auto cropped = crop(above);
  cropped = crop(above);
  CHECK((cloud | cropped).points.row(2).minCoeff() > 0);
}

TEST_CASE("a stored step can be replaced by another of its kind") {
  auto prepare = remove_invalid() | voxel_downsample(0.2);
  const auto cloud = some_cloud();
  const auto coarse = cloud | prepare;
  prepare = remove_invalid() | voxel_downsample(0.5);
  CHECK((cloud | prepare).size() < coarse.size());
  const auto shift_by = [](float x) {
    return step{[x](auto c) {
      c.points.array() += x;
      return c;
    }};
  };
  auto shift = shift_by(1);
  shift = shift_by(2);
  CHECK((cloud | shift).points(0, 0) == cloud.points(0, 0) + 2);
}

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

TEST_CASE("a report of each step of a line has their names") {
  pipeline_report report;
  const auto line = remove_invalid() | voxel_downsample(0.5) | take(3);
  const auto cloud = rich_cloud(70);
  CHECK((cloud | report_each(report, line)) == (cloud | line));
  REQUIRE(report.stages().size() == 4);
  CHECK(report.stages()[0].name == "input");
  CHECK((report.stages()[1].name == "remove_invalid" && report.stages()[1].points_out == 60));
  CHECK(report.stages()[2].name == "voxel_downsample");
  CHECK((report.stages()[3].name == "take" && report.stages()[3].points_out == 3));
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
