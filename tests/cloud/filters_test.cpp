// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

template <class T>
auto numbered_cloud(index_t count) {
  point_cloud<typename T::scalar, T::static_dimension> cloud;
  cloud.points = test::random_points<T>(count, 1);
  cloud.points.leftCols(5) *= typename T::scalar(9);
  std::vector<std::int32_t> numbers;
  for (index_t i = 0; i < count; ++i) numbers.push_back(std::int32_t(i));
  cloud.set_attribute("number", std::move(numbers));
  return cloud;
}

template <class C>
std::vector<std::int32_t> numbers_of(const C& cloud) {
  const auto all = cloud.template attribute_as<std::int32_t>("number");
  return {all.begin(), all.end()};
}

/// Points of a map, far from the origin, as a cloud that has the distance in its origin.
point_cloud<float, 3> map_cloud() {
  point_cloud<float, 3> cloud{.points = test::random_points<test::f3>(400, 2, -5, 5)};
  cloud.origin = {500000, 4600000, 100};
  return cloud;
}

Eigen::Matrix3Xd world(const point_cloud<float, 3>& cloud) {
  return cloud.points.cast<double>().colwise() + cloud.full_origin();
}

}  // namespace

TEST_CASE_TEMPLATE("each filter keeps what the function on points says, and tells what it removed",
                   T, ALL_SPACES) {
  const auto cloud = numbered_cloud<T>(300);
  index_list removed;
  const auto check = [&](const auto& filtered, std::vector<std::int32_t> kept) {
    CHECK(numbers_of(filtered) == kept);
    index_list rest;
    for (std::int32_t i = 0; i < 300; ++i)
      if (std::ranges::find(kept, i) == kept.end()) rest.push_back(std::int32_t(i));
    CHECK(removed == rest);
  };
  check(cloud | remove_statistical_outliers({.neighbors = 8, .deviations = 1}, &removed),
        statistical_outliers(cloud.points, {.neighbors = 8, .deviations = 1}).kept);
  CHECK(removed.size() >= 5);
  check(cloud | remove_radius_outliers({.radius = 0.4}, &removed),
        radius_outliers(cloud.points, {.radius = 0.4}).kept);
  check(cloud | random_sample(40, {.seed = 3}, &removed), random_indices(300, 40, 3));
  check(cloud | uniform_sample(7, &removed), uniform_indices(300, 7));
  check(cloud | farthest_point_sample(9, {}, &removed), farthest_point_sample(cloud.points, 9));
}

TEST_CASE_TEMPLATE("a cell is stood for by its mean or by one of its points, with all it has", T,
                   ALL_SPACES) {
  auto cloud = numbered_cloud<T>(500);
  cloud.normals = test::random_points<T>(500, 4);
  cloud.normals.colwise().normalize();
  const voxel_grid grid{cloud.points, 0.7};
  CHECK(numbers_of(cloud | voxel_downsample(0.7, {.pick = voxel_representative::first})) ==
        first_of_groups(grid.groups()));
  CHECK(numbers_of(cloud |
                   voxel_downsample(0.7, {.pick = voxel_representative::nearest_to_center})) ==
        nearest_to_centers(cloud.points, grid));
  CHECK(numbers_of(cloud |
                   voxel_downsample(0.7, {.pick = voxel_representative::medoid_of_normals})) ==
        medoids_of_normals(cloud.normals, grid.groups()));
  CHECK((cloud | voxel_downsample(0.7)).size() == grid.size());
  cloud.normals.resize(T::dimension, 0);
  CHECK_THROWS_AS(
      (void)(cloud | voxel_downsample(0.7, {.pick = voxel_representative::medoid_of_normals})),
      invalid_input);
}

TEST_CASE("normals of a cloud by an estimator, and consistent ones, are steps") {
  auto cloud = numbered_cloud<test::d3>(300);
  cloud.points.row(2).setZero();
  const auto robust = cloud | estimate_normals(knn{12}, minimum_covariance_determinant{}) |
                      orient_consistently(knn{12}, {.viewpoint = {{0, 0, -5}}});
  for (index_t i = 0; i < 300; ++i) CHECK(robust.normals(2, i) == doctest::Approx(-1));
  CHECK(robust.find_attribute("curvature") != nullptr);
  CHECK_THROWS_AS((void)(cloud | orient_consistently(knn{5})), invalid_input);
}

TEST_CASE("a transform moves the origin of a map in double, and its points stay small") {
  const auto cloud = map_cloud();
  Eigen::Isometry3f turn = Eigen::Isometry3f::Identity();
  turn.linear() = Eigen::AngleAxisf{0.5f, Eigen::Vector3f::UnitZ()}.toRotationMatrix();
  turn.translation() << 1, 2, 3;
  const auto moved = cloud | transform(turn);
  CHECK(moved.points.cwiseAbs().maxCoeff() < 10);
  const Eigen::Matrix3Xd expected =
      (turn.linear().cast<double>() * world(cloud)).colwise() + turn.translation().cast<double>();
  // A float at this distance would be off by a quarter of a metre.
  CHECK((world(moved) - expected).cwiseAbs().maxCoeff() < 1e-5);
}

TEST_CASE("cells of a map lie where they do in the world") {
  const auto cloud = map_cloud();
  point_cloud<double, 3> in_double;
  in_double.points = world(cloud);
  const auto a = cloud | voxel_downsample(0.3);
  const auto b = in_double | voxel_downsample(0.3);
  REQUIRE(a.size() == b.size());
  CHECK((world(a) - b.points).cwiseAbs().maxCoeff() < 1e-5);
  CHECK(a.origin == cloud.origin);
}

TEST_CASE("viewpoints are places in the world, and appended maps meet there") {
  auto cloud = map_cloud();
  cloud.points.row(2).setZero();
  const auto up = cloud | estimate_normals(knn{8}, {.viewpoint = {{500000, 4600000, 110}}});
  CHECK(up.normals(2, 7) == doctest::Approx(1));
  const auto down = up | orient_to_viewpoint({500000, 4600000, 90});
  CHECK(down.normals(2, 7) == doctest::Approx(-1));

  auto other = map_cloud();
  other.origin += Eigen::Vector3d{10, -20, 0.5};
  const auto both = append(map_cloud(), other);
  CHECK(both.origin == map_cloud().origin);
  CHECK((world(both).rightCols(400) - world(other)).cwiseAbs().maxCoeff() < 1e-5);
  CHECK(append(point_cloud<float, 3>{}, other).origin == other.origin);
  CHECK(cast<double>(other).origin == other.origin);
  CHECK((other | random_sample(5)).origin == other.origin);
  CHECK_FALSE(map_cloud() == other);
}

TEST_CASE("an organised cloud stays one as long as it keeps all points") {
  point_cloud<float, 3> cloud{.points = test::random_points<test::f3>(12), .width = 4, .height = 3};
  CHECK(cloud.is_organized());
  CHECK((cloud | remove_invalid()).is_organized());
  CHECK((cloud | transform(Eigen::Isometry3f::Identity())).is_organized());
  CHECK(cast<double>(cloud).is_organized());
  CHECK_FALSE((cloud | random_sample(5)).is_organized());
  CHECK_FALSE(append(cloud, cloud).is_organized());
  cloud.points(0, 3) = test::nan<float>;
  CHECK_FALSE((cloud | remove_invalid()).is_organized());
  cloud.width = 5;
  CHECK_THROWS_AS((void)(cloud | remove_invalid()), invalid_input);
  cloud.width = 4;
  cloud.origin[1] = test::nan<double>;
  CHECK_THROWS_AS((void)(cloud | remove_invalid()), invalid_input);
}

TEST_CASE_TEMPLATE("a choice is by indices, a mask or a predicate, and has a complement", T,
                   test::f3, test::dx) {
  const auto cloud = numbered_cloud<T>(10);
  std::vector<std::uint8_t> bytes(10);
  std::vector<bool> bits(10);
  for (const std::size_t i : {1, 4, 5}) bytes[i] = bits[i] = true;
  const std::vector<std::int32_t> chosen{1, 4, 5}, others{0, 2, 3, 6, 7, 8, 9};
  const auto predicate = [](index_t i) { return i == 1 || i == 4 || i == 5; };
  CHECK(numbers_of(select(cloud, bytes)) == chosen);
  CHECK(numbers_of(select(cloud, bits)) == chosen);
  CHECK(numbers_of(exclude(cloud, bytes)) == others);
  CHECK(numbers_of(exclude(cloud, bits)) == others);
  CHECK(numbers_of(exclude(cloud, std::vector{5, 1, 4, 4})) == others);
  CHECK(numbers_of(exclude(cloud, predicate)) == others);
  CHECK((cloud | select(bytes)) == (cloud | select(predicate)));
  CHECK((cloud | exclude(std::vector{1, 4, 5})) == (cloud | exclude(predicate)));
  CHECK_THROWS_WITH_AS((void)select(cloud, std::vector<bool>(9)),
                       "select: the mask has 9 values, and there are 10 points", invalid_input);
  CHECK_THROWS_AS((void)exclude(cloud, std::vector<bool>(11)), invalid_input);
  CHECK_THROWS_WITH_AS((void)exclude(cloud, std::vector{10}),
                       "exclude: the index 10 is out of range: there are 10 points", invalid_input);
}

TEST_CASE("the cores of a clustering are selected by the mask that it has") {
  const point_cloud<float, 3> cloud{.points = test::random_points<test::f3>(100)};
  const auto found = dbscan(cloud.points, {.radius = 0.4, .min_points = 5});
  const auto cores = std::ranges::count(found.is_core, std::uint8_t{1});
  REQUIRE(cores > 0);
  CHECK(select(cloud, found.is_core).size() == cores);
  CHECK(exclude(cloud, found.is_core).size() == 100 - cores);
}

TEST_CASE("a voxel has the lower median of the whole numbers in it, however few there are") {
  for (const int n : {1, 2, 3, 4, 5}) {
    std::vector<int> values(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) values[i] = i % 3 - 1;
    std::ranges::sort(values);
    const int expected = values[(values.size() - 1) / 2];
    do {
      point_cloud<float, 3> cloud;
      cloud.points = Eigen::Matrix3Xf::Constant(3, n, 0.5F);
      cloud.set_attribute(
          "number", attribute_values{std::vector<std::int32_t>(values.begin(), values.end())});
      const auto thin = voxel_downsample(cloud, 1);
      REQUIRE(thin.size() == 1);
      CHECK(thin.attribute_as<std::int32_t>("number")[0] == expected);
    } while (std::ranges::next_permutation(values).found);
  }
}
