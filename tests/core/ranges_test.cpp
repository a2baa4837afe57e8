// SPDX-License-Identifier: MIT
//
// Which concepts of the standard library the types of this module model.
#include <array>
#include <cstdint>
#include <iterator>
#include <ranges>
#include <span>
#include <type_traits>
#include <vector>

#include "spaces.hpp"

import cilantro.core;
import test_support;

using namespace cilantro;
namespace ranges = std::ranges;

template <class T>
constexpr bool is_lasting_view =
    ranges::random_access_range<const T> && ranges::sized_range<const T> &&
    ranges::common_range<T> && ranges::view<T> && ranges::borrowed_range<T>;

static_assert(is_lasting_view<points_view<float, 3>>);
static_assert(is_lasting_view<points_view<double, dynamic>>);
static_assert(is_lasting_view<mutable_points_view<float, 3>>);
static_assert(is_lasting_view<image_view<float>>);
static_assert(ranges::random_access_range<const image<float>> && !ranges::view<image<float>>);
static_assert(!ranges::borrowed_range<image<float>>);

// What is kept of an element is a point, not a look at one.
static_assert(std::same_as<ranges::range_value_t<points_view<float, 3>>, Eigen::Vector3f>);
static_assert(
    std::same_as<ranges::range_value_t<mutable_points_view<double, dynamic>>, Eigen::VectorXd>);
static_assert(
    std::same_as<ranges::range_value_t<image<std::uint8_t>>, std::span<const std::uint8_t>>);

// Whose memory may be written to.
static_assert(MutablePoints<Eigen::Matrix3Xf&> && !MutablePoints<const Eigen::Matrix3Xf&>);
static_assert(MutablePoints<std::vector<Eigen::Vector3f>&>);
static_assert(!MutablePoints<const std::vector<Eigen::Vector3f>&>);
static_assert(!MutablePoints<std::vector<Eigen::Vector3f>>);  // It dies with its points.
static_assert(MutablePoints<std::span<std::array<double, 3>>>);
static_assert(!MutablePoints<std::span<const std::array<double, 3>>>);
static_assert(MutablePoints<Eigen::Map<Eigen::Matrix3Xd>>);
static_assert(!MutablePoints<Eigen::Map<const Eigen::Matrix3Xd>>);
static_assert(MutablePoints<mutable_points_view<float, 2>> &&
              !MutablePoints<points_view<float, 2>>);
static_assert(PointsSource<mutable_points_view<float, 2>>);

TEST_CASE("points that a container collects from a view stay when the view's storage changes") {
  Eigen::Matrix3Xf points = test::random_points<test::f3>(5);
  const Eigen::Matrix3Xf before = points;
  const auto view = as_points(points);
  const std::vector<ranges::range_value_t<points_view<float, 3>>> kept(view.begin(), view.end());
  points.setZero();
  for (index_t i = 0; i < 5; ++i) CHECK(kept[std::size_t(i)] == before.col(i));
}

TEST_CASE_TEMPLATE("to_points collects what any view leaves", T, ALL_SPACES) {
  using S = typename T::scalar;
  constexpr int D = T::static_dimension;
  const point_matrix<S, D> points = test::random_points<T>(50);
  const auto wanted = [](const auto& p) { return p[0] > 0; };
  const point_matrix<S, D> some = as_points(points) | std::views::filter(wanted) | to_points();
  index_t next = 0;
  for (index_t i = 0; i < points.cols(); ++i)
    if (points(0, i) > 0) CHECK(some.col(next++) == points.col(i));
  CHECK(next == some.cols());
  CHECK(to_points(as_points(points)) == points);
  CHECK(to_points(as_points(points) | std::views::take(0)).cols() == 0);
  const point_matrix<S, D> doubled =
      to_points(as_points(points) |
                std::views::transform([](const auto& p) { return point_vector<S, D>{2 * p}; }));
  CHECK(doubled == 2 * points);
}

TEST_CASE("to_points takes arrays, and refuses points of different dimension") {
  const std::vector<std::array<float, 2>> arrays{{1, 2}, {3, 4}, {5, 6}};
  const Eigen::Matrix2Xf found = arrays | std::views::reverse | to_points();
  CHECK(found == (Eigen::Matrix2Xf(2, 3) << 5, 3, 1, 6, 4, 2).finished());
  const std::vector<Eigen::VectorXd> different{Eigen::VectorXd::Zero(2), Eigen::VectorXd::Zero(3)};
  CHECK_THROWS_AS((void)to_points(different), invalid_input);
}

TEST_CASE("an image is a range of its rows, and so is a part of one") {
  image<int> picture{4, 3};
  for (int i = 0; i < 12; ++i) picture.pixels()[std::size_t(i)] = i;
  int rows = 0, sum = 0;
  for (const auto row : picture) {
    CHECK(row.size() == 4);
    CHECK(row.front() == 4 * rows++);
    for (const int pixel : row) sum += pixel;
  }
  CHECK((rows == 3 && sum == 66));
  picture[1][2] = 100;
  CHECK(picture(2, 1) == 100);
  const image_view<int> left{picture.pixels().data(), 2, 3, 4};
  CHECK(ranges::ssize(left) == 3);
  CHECK((left[2].size() == 2 && left[2][1] == 9));
  CHECK(ranges::distance(image<int>{}) == 0);
}

TEST_CASE_TEMPLATE("functions write into memory of any kind", T, ALL_SPACES) {
  using S = typename T::scalar;
  constexpr int D = T::static_dimension;
  const point_matrix<S, D> points = test::random_points<T>(20);
  affine_transform<S, D> by = identity_transform<affine_transform<S, D>>(T::dimension);
  by.translation().setConstant(S(3));
  by.linear() *= S(2);
  const point_matrix<S, D> moved = transform_points(by, points);
  // Every second record of padded ones.
  const index_t stride = T::dimension + 2;
  std::vector<S> records(std::size_t(stride * 20), S(7));
  const auto target = [&] {
    if constexpr (D == dynamic)
      return mutable_points_view<S, D>{records.data(), 20, T::dimension, stride};
    else
      return mutable_points_view<S, D>{records.data(), 20, stride};
  }();
  transform_points(by, points, target);
  CHECK(target.matrix() == moved);
  for (index_t i = 0; i < 20; ++i) CHECK(records[std::size_t(i * stride + T::dimension)] == 7);
  transform_points(by, target, target);  // In place.
  CHECK(target.matrix() == transform_points(by, moved));
  target[3].setZero();
  CHECK(points_view<S, D>{target}[3].isZero(0));
  CHECK_THROWS_AS(transform_points(by, points.leftCols(3), target), invalid_input);
}

TEST_CASE("a vector of fixed-size points takes what is written to points") {
  const Eigen::Matrix3Xd points = test::random_points<test::d3>(10);
  const Eigen::Isometry3d by{Eigen::AngleAxisd{1, Eigen::Vector3d::UnitZ()}};
  std::vector<Eigen::Vector3d> moved(10);
  transform_points(by, points, moved);
  CHECK(as_points(moved).matrix() == transform_points(by, points));
  std::vector<std::array<double, 3>> arrays(10);
  transform_normals(by, points, std::span{arrays});
  CHECK(as_points(arrays).matrix() == transform_normals(by, points));
}
