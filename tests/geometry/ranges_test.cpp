// SPDX-License-Identifier: MIT
//
// Which concepts of the standard library the types of this module model.
#include <concepts>
#include <cstdint>
#include <iterator>
#include <ranges>
#include <span>
#include <vector>

#include "spaces.hpp"

import cilantro.geometry;
import test_support;

using namespace cilantro;
namespace ranges = std::ranges;

template <class T>
constexpr bool is_owning_range =
    ranges::random_access_range<const T> && ranges::sized_range<const T> &&
    ranges::common_range<const T> && !ranges::view<T> && !ranges::borrowed_range<T>;

static_assert(is_owning_range<point_groups>);
static_assert(is_owning_range<voxel_grid<float, 3>>);
static_assert(std::same_as<ranges::range_value_t<point_groups>, std::span<const std::int32_t>>);
static_assert(
    std::same_as<ranges::range_value_t<voxel_grid<double, 2>>, std::span<const std::int32_t>>);

TEST_CASE("the cells of a grid are a range of the indices of their points") {
  const Eigen::Matrix3Xf points = test::random_points<test::f3>(300);
  const voxel_grid grid{points, 0.5};
  index_t count = 0, cell = 0;
  for (const auto members : grid) {
    CHECK(grid.find(members.front()) == cell++);
    count += std::ssize(members);
  }
  CHECK((cell == grid.size() && count == 300));
  const auto crowded = std::views::filter([](const auto& some) { return some.size() > 2; });
  for (const auto members : grid | crowded) CHECK(members.size() > 2);
}

TEST_CASE_TEMPLATE("normals are written into memory of any kind", T, ALL_SPACES) {
  using S = typename T::scalar;
  constexpr int D = T::static_dimension;
  const point_matrix<S, D> points = test::random_points<T>(80);
  const auto expected = estimate_normals(points, knn{9});
  point_matrix<S, D> normals(T::dimension, 80);
  write_normals(points, knn{9}, normals);
  CHECK(normals == expected.normals);
  point_matrix<S, D> wide = point_matrix<S, D>::Constant(T::dimension, 90, S(5));
  const auto near = find_neighborhoods(kd_tree{points}, points, knn{9});
  write_normals(points, near, wide.leftCols(80));
  CHECK(wide.leftCols(80) == estimate_normals(points, near).normals);
  CHECK(wide.rightCols(10).cwiseEqual(S(5)).all());
  CHECK_THROWS_AS(write_normals(points, knn{9}, wide), invalid_input);
  CHECK_THROWS_AS(write_normals(normals, knn{9}, normals), invalid_input);
  point_matrix<S, D> both(T::dimension, 81);
  CHECK_THROWS_AS(write_normals(both.leftCols(80), knn{9}, both.rightCols(80)), invalid_input);
}

TEST_CASE("records of points and normals side by side do not overlap") {
  std::vector<double> records(80 * 6);
  mutable_points_view<double, 3> points{records.data(), 80, 6}, normals{records.data() + 3, 80, 6};
  points.matrix() = test::random_points<test::d3>(80);
  write_normals(points, knn{9}, normals);
  CHECK(normals.matrix() == estimate_normals(points, knn{9}).normals);
}

TEST_CASE("points given in place of normals, and viewpoints that are nowhere, are refused") {
  Eigen::Matrix3Xd points = 2 * test::random_points<test::d3>(80);
  auto normals = estimate_normals(points, knn{9}).normals;
  CHECK_THROWS_AS(orient_to_viewpoint(points, normals, {0, 0, 1}), invalid_input);
  CHECK_THROWS_AS((void)orient_consistently(points, normals, knn{9}), invalid_input);
  CHECK_THROWS_AS(orient_to_viewpoint(normals, points, {0, 0, test::nan<double>}), invalid_input);
  CHECK_THROWS_AS((void)orient_consistently(normals, points, knn{9},
                                            {.viewpoint = {{test::infinity<double>, 0, 0}}}),
                  invalid_input);
}

TEST_CASE("normals of a vector of points are turned where they lie") {
  const Eigen::Matrix3Xd points = test::random_points<test::d3>(80);
  auto expected = estimate_normals(points, knn{9}).normals;
  std::vector<Eigen::Vector3d> normals(80);
  write_normals(points, knn{9}, normals);
  CHECK(as_points(normals).matrix() == expected);
  orient_to_viewpoint(normals, points, {9, 8, -7});
  orient_to_viewpoint(expected, points, {9, 8, -7});
  CHECK(as_points(normals).matrix() == expected);
  CHECK(orient_consistently(normals, points, knn{9}) ==
        orient_consistently(expected, points, knn{9}));
  CHECK(as_points(normals).matrix() == expected);
  for (auto& n : normals) n = -n;
  orient_to_reference(normals, expected);
  CHECK(as_points(normals).matrix() == expected);
}
