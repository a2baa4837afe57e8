// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

template <class T>
using cloud_of = point_cloud<typename T::scalar, T::static_dimension>;

/// A cloud that has everything; point i bears the number i wherever a number fits.
template <class T>
cloud_of<T> full_cloud(index_t count, std::uint64_t seed = 1) {
  cloud_of<T> cloud;
  cloud.points = test::random_points<T>(count, seed);
  cloud.normals = test::random_points<T>(count, seed + 1);
  cloud.normals.colwise().normalize();
  cloud.colors = test::random_points<test::f3>(count, seed + 2, 0, 1);
  std::vector<std::int32_t> label;
  std::vector<double> time;
  std::vector<std::uint8_t> intensity;
  for (index_t i = 0; i < count; ++i) {
    label.push_back(std::int32_t(i));
    time.push_back(double(i) / 8);
    intensity.push_back(std::uint8_t(i));
  }
  cloud.set_attribute("label", std::move(label));
  cloud.set_attribute("time", std::move(time));
  cloud.set_attribute("intensity", std::move(intensity));
  cloud.comments = {"made by a test"};
  return cloud;
}

/// Whether `part` holds the given points of `whole`, with everything.
template <class C>
bool consists_of(const C& part, const C& whole, const std::vector<index_t>& indices) {
  bool same = part.size() == std::ssize(indices) && part.comments == whole.comments &&
              part.attributes.size() == whole.attributes.size();
  for (index_t j = 0; same && j < part.size(); ++j) {
    const index_t i = indices[std::size_t(j)];
    same = test::same_bits(part.points.col(j), whole.points.col(i)) &&
           part.normals.col(j) == whole.normals.col(i) && part.colors.col(j) == whole.colors.col(i);
    for (std::size_t a = 0; same && a < whole.attributes.size(); ++a)
      same = part.attributes[a].name == whole.attributes[a].name &&
             std::visit(
                 [&]<class V>(const V& values) {
                   return std::get<V>(part.attributes[a].values)[std::size_t(j)] ==
                          values[std::size_t(i)];
                 },
                 whole.attributes[a].values);
  }
  return same;
}

}  // namespace

static_assert(PointCloud<point_cloud<float, 3>> && PointCloud<const point_cloud<double, 2>&>);
static_assert(!PointCloud<Eigen::Matrix3Xf>);

static_assert(IndexRange<std::vector<int>> && IndexRange<std::span<const std::uint16_t>>);
static_assert(!IndexRange<std::vector<std::uint8_t>> && MaskRange<std::vector<std::uint8_t>>);
static_assert(!IndexRange<std::vector<bool>>, "a mask is not a list of the points 0 and 1");

TEST_CASE_TEMPLATE("selection by indices keeps everything of the selected points", T, ALL_SPACES) {
  const auto cloud = full_cloud<T>(20);
  CHECK(consists_of(select(cloud, std::vector{3, 1, 1, 19}), cloud, {3, 1, 1, 19}));
  CHECK(consists_of(select(cloud, std::vector<index_t>{}), cloud, {}));
  CHECK_THROWS_AS((void)select(cloud, std::vector{20}), invalid_input);
  CHECK_THROWS_AS((void)select(cloud, std::vector{-1}), invalid_input);
}

TEST_CASE_TEMPLATE("selection by a predicate keeps everything of the points that satisfy it", T,
                   ALL_SPACES) {
  const auto cloud = full_cloud<T>(9);
  CHECK(consists_of(select(cloud, [](index_t i) { return i % 3 == 1; }), cloud, {1, 4, 7}));
  CHECK(select(cloud, [](index_t) { return false; }).empty());
}

TEST_CASE_TEMPLATE("invalid points are removed with everything that belongs to them", T,
                   ALL_SPACES) {
  auto cloud = full_cloud<T>(6);
  cloud.points(0, 2) = test::nan<typename T::scalar>;
  cloud.points(T::dimension - 1, 5) = -test::infinity<typename T::scalar>;
  CHECK(consists_of(remove_invalid(cloud), cloud, {0, 1, 3, 4}));
}

TEST_CASE("a cloud without invalid points is handed on in the same memory") {
  auto cloud = full_cloud<test::f3>(6);
  const float* memory = cloud.points.data();
  CHECK(remove_invalid(std::move(cloud)).points.data() == memory);
}

TEST_CASE_TEMPLATE("a transform moves points and normals, and leaves the rest", T, test::f2,
                   test::f3, test::d2, test::d3) {
  using S = typename T::scalar;
  const auto cloud = full_cloud<T>(15);
  Eigen::Transform<S, T::static_dimension, Eigen::Affine> by;
  by.setIdentity();
  by.linear()(0, 1) = S(0.5);
  by.linear()(1, 1) = 2;
  by.translation().setConstant(3);
  const auto moved = transform(cloud, by);
  CHECK((moved.points - transform_points(by, cloud.points)).isZero(0));
  CHECK((moved.normals - transform_normals(by, cloud.normals)).isZero(0));
  CHECK(moved.colors == cloud.colors);
  CHECK(moved.attributes == cloud.attributes);
  CHECK(moved.comments == cloud.comments);
  by.linear().setZero();
  CHECK_THROWS_AS((void)transform(cloud, by), invalid_input);
  auto without_normals = cloud;
  without_normals.normals.resize(T::dimension, 0);
  CHECK(transform(without_normals, by).points.isApproxToConstant(3));
}

TEST_CASE("a transform in double moves a cloud of float, and its origin by all digits") {
  auto cloud = full_cloud<test::f3>(15);
  Eigen::Isometry3d by{Eigen::AngleAxisd{0.5, Eigen::Vector3d::UnitX()}};
  by.translation() = Eigen::Vector3d{1.0 / 3, 2, 3};
  CHECK(transform(cloud, by) == transform(cloud, by.cast<float>()));
  CHECK((cloud | transform(by)) == transform(cloud, by));
  cloud.origin = Eigen::Vector3d{400'000.25, 5'600'000.5, 100};
  const auto moved = transform(cloud, by);
  CHECK((moved.origin - by * cloud.origin).isZero(1e-9));
  CHECK((moved.points - by.linear().cast<float>() * cloud.points).isZero(1e-6f));
  // What the scalar cannot hold becomes the origin.
  by.translation() = Eigen::Vector3d{500'000.3, 4'500'000.3, 0};
  const auto on_a_map = transform(full_cloud<test::f3>(15), by);
  CHECK(on_a_map.origin == by.translation());
  CHECK((on_a_map.points - by.linear().cast<float>() * full_cloud<test::f3>(15).points)
            .isZero(1e-6f));
  by.translation().setZero();
  const affine_transform<double, dynamic> at_run_time{by.linear(), by.translation()};
  CHECK(transform(full_cloud<test::f3>(15), at_run_time)
            .points.isApprox(transform(full_cloud<test::f3>(15), by).points));
}

TEST_CASE_TEMPLATE("an appended cloud follows with everything", T, ALL_SPACES) {
  const auto both = full_cloud<T>(10);
  const auto first = select(both, std::vector{0, 1, 2}),
             second = select(both, std::vector{3, 4, 5, 6, 7, 8, 9});
  auto joined = append(first, second);
  CHECK(joined.comments.size() == 2);
  joined.comments = both.comments;
  CHECK(consists_of(joined, both, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9}));
  CHECK(append(cloud_of<T>{}, both).attributes == both.attributes);
  CHECK(append(both, cloud_of<T>{}).size() == 10);
}

TEST_CASE("clouds that know different things are not appended, and the difference is named") {
  const auto cloud = full_cloud<test::f3>(4);
  auto other = cloud;
  other.normals.resize(3, 0);
  CHECK_THROWS_WITH_AS((void)append(cloud, other), "append: only one of the clouds has normals",
                       invalid_input);
  other = cloud;
  other.colors.resize(3, 0);
  CHECK_THROWS_WITH_AS((void)append(cloud, other), "append: only one of the clouds has colors",
                       invalid_input);
  other = cloud;
  other.attributes.pop_back();
  const auto* missing = "append: only one of the clouds has the attribute \"intensity\"";
  CHECK_THROWS_WITH_AS((void)append(cloud, other), missing, invalid_input);
  CHECK_THROWS_WITH_AS((void)append(other, cloud), missing, invalid_input);
  other = cloud;
  other.set_attribute("label", std::vector<float>(4));
  CHECK_THROWS_WITH_AS((void)append(cloud, other),
                       "append: the attribute \"label\" has different types in the two clouds",
                       invalid_input);
  point_cloud<float, dynamic> two, three;
  two.points.resize(2, 1);
  three.points.resize(3, 1);
  CHECK_THROWS_AS((void)append(two, three), invalid_input);
}

TEST_CASE("a cast changes the scalar of points and normals only") {
  const auto cloud = full_cloud<test::d3>(5);
  const auto single = cast<float>(cloud);
  CHECK(test::same_bits(single.points, cloud.points.cast<float>()));
  CHECK(test::same_bits(single.normals, cloud.normals.cast<float>()));
  CHECK(single.attributes == cloud.attributes);
  CHECK(single.colors == cloud.colors);
}

TEST_CASE_TEMPLATE("estimated normals replace those that were there, and the rest is kept", T,
                   ALL_SPACES) {
  const auto cloud = full_cloud<T>(60);
  const auto with_normals = estimate_normals(cloud, knn{12});
  const auto found = estimate_normals(cloud.points, knn{12});
  CHECK(test::same_bits(with_normals.normals, found.normals));
  const auto curvature = with_normals.template attribute_as<typename T::scalar>("curvature");
  CHECK(std::ranges::equal(curvature, found.curvature));
  CHECK(with_normals.attributes.size() == 4);
  CHECK(with_normals.colors == cloud.colors);
  CHECK(estimate_normals(with_normals, knn{12}).attributes.size() == 4);
  CHECK(estimate_normals(cloud_of<T>{}, knn{12}).empty());
}

TEST_CASE_TEMPLATE("a downsampled cloud has a value of everything per cell", T, ALL_SPACES) {
  using S = typename T::scalar;
  const auto cloud = full_cloud<T>(500);
  const auto small = voxel_downsample(cloud, 1.0);
  const voxel_grid grid{cloud.points, 1.0};
  REQUIRE(small.size() == grid.size());
  CHECK(test::same_bits(small.points, voxel_downsample(cloud.points, 1.0)));
  CHECK(small.comments == cloud.comments);
  for (index_t c = 0; c < grid.size(); ++c) {
    const auto members = grid[c];
    double time = 0;
    std::vector<std::int32_t> labels(members.begin(), members.end());
    for (const auto i : members) time += double(i) / 8;
    CHECK(small.template attribute_as<double>("time")[std::size_t(c)] ==
          doctest::Approx(time / double(members.size())));
    CHECK(small.template attribute_as<std::int32_t>("label")[std::size_t(c)] ==
          labels[(labels.size() - 1) / 2]);
    const S length = small.normals.col(c).norm();
    CHECK((length == 0 || std::abs(length - 1) < S(1e-6)));
  }
}

TEST_CASE("attributes are found by name and type") {
  auto cloud = full_cloud<test::f3>(3);
  CHECK(cloud.attribute_as<std::int32_t>("label")[2] == 2);
  CHECK(cloud.find_attribute("none") == nullptr);
  CHECK_THROWS_WITH_AS((void)cloud.attribute_as<float>("none"),
                       "the cloud has no attribute \"none\"", invalid_input);
  CHECK_THROWS_WITH_AS((void)cloud.attribute_as<float>("label"),
                       "the attribute \"label\" holds int32, and float was requested",
                       invalid_input);
  CHECK_THROWS_AS(cloud.set_attribute("label", std::vector<float>(2)), invalid_input);
  CHECK(cloud.attribute_as<std::int32_t>("label").size() == 3);
}

TEST_CASE(
    "a cloud whose parts do not fit each other is refused by every function, which says how") {
  auto cloud = full_cloud<test::f3>(5);
  cloud.normals.conservativeResize(3, 4);
  CHECK_THROWS_WITH_AS((void)remove_invalid(cloud),
                       "remove_invalid: the cloud has 5 points but 4 normals", invalid_input);
  CHECK_THROWS_AS((void)voxel_downsample(cloud, 1), invalid_input);
  CHECK_THROWS_AS((void)select(cloud, std::vector{1}), invalid_input);
  cloud = full_cloud<test::f3>(5);
  cloud.colors.resize(3, 6);
  CHECK_THROWS_WITH_AS((void)estimate_normals(cloud, knn{3}),
                       "estimate_normals: the cloud has 5 points but 6 colors", invalid_input);
  cloud = full_cloud<test::f3>(5);
  std::get<std::vector<double>>(cloud.attributes[1].values).pop_back();
  CHECK_THROWS_WITH_AS((void)transform(cloud, Eigen::Isometry3f::Identity()),
                       "transform: the cloud has 5 points but 4 values of the attribute \"time\"",
                       invalid_input);
  cloud = full_cloud<test::f3>(5);
  cloud.attributes[2].name = "label";
  CHECK_THROWS_WITH_AS((void)append(cloud, cloud), "append: the cloud has two attributes \"label\"",
                       invalid_input);
}

TEST_CASE("orientation asks for normals in a sentence") {
  auto cloud = full_cloud<test::f3>(5);
  const auto turned = orient_to_viewpoint(cloud, {10, 0, 0});
  for (index_t i = 0; i < 5; ++i)
    CHECK(turned.normals.col(i).dot(Eigen::Vector3f{10, 0, 0} - cloud.points.col(i)) >= 0);
  cloud.normals.resize(3, 0);
  CHECK_THROWS_WITH_AS((void)orient_to_viewpoint(cloud, {0, 0, 0}),
                       "orient_to_viewpoint: the cloud has no normals; estimate them first",
                       invalid_input);
}
