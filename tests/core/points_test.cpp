// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <ranges>
#include <span>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

struct own_point_set {
  std::vector<float> xyzw;
};

using row_major = Eigen::Matrix<float, 3, dynamic, Eigen::RowMajor>;
using every_other_row =
    Eigen::Map<Eigen::Matrix3Xf, Eigen::Unaligned, Eigen::Stride<dynamic, dynamic>>;
using array3 = std::array<float, 3>;

}  // namespace

template <>
struct cilantro::points_traits<own_point_set> {
  static points_view<float, 3> view(const own_point_set& s) {
    return {s.xyzw.data(), static_cast<index_t>(s.xyzw.size()) / 4, 4};
  }
};

static_assert(PointsSource<Eigen::Matrix3Xf> && dimension_of<Eigen::Matrix3Xf> == 3);
static_assert(PointsSource<Eigen::MatrixXd> && dimension_of<Eigen::MatrixXd> == dynamic);
static_assert(PointsSource<Eigen::Map<const Eigen::Matrix2Xd>>);
static_assert(PointsSource<Eigen::Block<Eigen::MatrixXf>>);
static_assert(PointsSource<std::vector<array3>> && PointsSource<std::span<const array3>>);
static_assert(PointsSource<std::vector<Eigen::Vector2d>>);
static_assert(PointsSource<std::array<array3, 7>>);
static_assert(PointsSource<points_view<double, 5>>);
static_assert(PointsSource<own_point_set>);

static_assert(!PointsSource<row_major>, "coordinates of a point must be adjacent");
static_assert(!PointsSource<every_other_row>, "coordinates of a point must be adjacent");
static_assert(!PointsSource<Eigen::Matrix3Xi>, "coordinates must be float or double");
static_assert(!PointsSource<std::vector<float>>, "a range of numbers has no dimension");
static_assert(!PointsSource<decltype(Eigen::Matrix3Xf{} + Eigen::Matrix3Xf{})>,
              "an expression has no storage");

static_assert(BorrowedPoints<Eigen::Matrix3Xf&>);
static_assert(!BorrowedPoints<Eigen::Matrix3Xf>, "a view must not outlive a temporary");
static_assert(!BorrowedPoints<std::vector<array3>>);
static_assert(BorrowedPoints<std::span<const array3>>);
static_assert(BorrowedPoints<points_view<float, 3>>);
static_assert(BorrowedPoints<Eigen::Map<const Eigen::Matrix2Xd>>);

static_assert(std::ranges::random_access_range<points_view<float, 3>>);
static_assert(std::ranges::view<points_view<float, 3>>);
static_assert(std::ranges::borrowed_range<points_view<float, dynamic>>);
static_assert(std::convertible_to<points_view<float, 3>, points_view<float, dynamic>>);
static_assert(!std::convertible_to<points_view<float, dynamic>, points_view<float, 3>>);

TEST_CASE_TEMPLATE("a view of a matrix looks at the matrix's own memory", T, ALL_SPACES) {
  const auto points = test::random_points<T>(17);
  const auto view = as_points(points);
  CHECK(view.data() == points.data());
  CHECK(view.size() == 17);
  CHECK(view.dimension() == T::dimension);
  CHECK(test::same_bits(view.matrix(), points));
  for (index_t i = 0; i < 17; ++i) CHECK(view[i] == points.col(i));
}

TEST_CASE("a block of a matrix is seen in place, with the stride of the whole") {
  Eigen::MatrixXd all = Eigen::MatrixXd::Random(7, 10);
  const auto view = as_points(all.block(2, 3, 4, 5));
  CHECK(view.data() == &all(2, 3));
  CHECK(view.stride() == 7);
  CHECK(view.dimension() == 4);
  CHECK(test::same_bits(view.matrix(), all.block(2, 3, 4, 5)));
}

TEST_CASE("contiguous ranges of arrays and of Eigen vectors are points") {
  const std::vector<array3> arrays{{1, 2, 3}, {4, 5, 6}};
  CHECK(as_points(arrays)[1] == Eigen::Vector3f{4, 5, 6});
  CHECK(as_points(std::span{arrays}).data() == arrays[0].data());
  const std::vector<Eigen::Vector2d> vectors{{1, 2}, {3, 4}, {5, 6}};
  CHECK(as_points(vectors).size() == 3);
  CHECK(as_points(vectors)[2] == Eigen::Vector2d{5, 6});
  const std::vector<Eigen::Vector4f> padded{{1, 2, 3, 1}, {4, 5, 6, 1}};
  CHECK(as_points(padded)[1] == Eigen::Vector4f{4, 5, 6, 1});
}

TEST_CASE("raw pointers and padded or interleaved records are seen without a copy") {
  const float records[] = {1, 2, 3, 0, 0, 1, 4, 5, 6, 1, 0, 0};
  const points_view<float, 3> points{records, 2, 6}, normals{records + 3, 2, 6};
  CHECK(points[1] == Eigen::Vector3f{4, 5, 6});
  CHECK(normals[1] == Eigen::Vector3f{1, 0, 0});
  const points_view<float, 3> packed{records, 4};
  CHECK(packed[3] == Eigen::Vector3f{1, 0, 0});
  const points_view<float, dynamic> run_time{records, 2, 3, 6};
  CHECK(test::same_bits(run_time.matrix(), points.matrix()));
}

TEST_CASE("a user's own type is seen through one trait") {
  const own_point_set mine{{1, 2, 3, 1, 4, 5, 6, 1}};
  CHECK(as_points(mine).data() == mine.xyzw.data());
  CHECK(as_points(mine)[1] == Eigen::Vector3f{4, 5, 6});
  CHECK(mean_and_covariance(mine)->mean == Eigen::Vector3f{2.5f, 3.5f, 4.5f});
}

TEST_CASE("a matrix of one row holds one coordinate per point") {
  const point_matrix<double, 1> line{{3, 1, 2}};
  CHECK(as_points(line).size() == 3);
  CHECK(as_points(line)[2][0] == 2);
  CHECK(test::same_bits(as_points(line).matrix(), line));
}

TEST_CASE("a view is a range of its columns that the standard views take") {
  const auto points = test::random_points<test::f3>(100);
  const auto view = as_points(points);
  auto above = view | std::views::filter([](const auto& p) { return p.z() > 0; });
  CHECK(std::ranges::distance(above) == (points.row(2).array() > 0).count());
  CHECK((view | std::views::drop(7)).front() == points.col(7));
  CHECK(view.end()[-1] == points.col(99));
  CHECK(std::ranges::max(view | std::views::transform([](const auto& p) { return p.x(); })) ==
        points.row(0).maxCoeff());
  CHECK(view.slice(10, 5)[4] == points.col(14));
}

TEST_CASE("an empty view has no points, whatever it was made from") {
  CHECK(points_view<float, 3>{}.empty());
  CHECK(points_view<float, 3>{nullptr, 0}.empty());
  const std::vector<array3> no_arrays;
  CHECK(as_points(no_arrays).empty());
  const Eigen::MatrixXf none(3, 0);
  CHECK(as_points(none).empty());
  CHECK(as_points(none).dimension() == 3);
}

TEST_CASE("a view refuses sizes that cannot be") {
  const float data[6] = {};
  using view3 = points_view<float, 3>;
  CHECK_THROWS_AS(view3(data, -1), invalid_input);
  CHECK_THROWS_AS(view3(data, 2, 2), invalid_input);
  CHECK_THROWS_AS(view3(nullptr, 2), invalid_input);
  CHECK_THROWS_AS((points_view<float, dynamic>(data, 2, 3, 2)), invalid_input);
  CHECK_THROWS_AS((points_view<float, dynamic>(data, 2, -1, 2)), invalid_input);
}

TEST_CASE("non-finite points are counted") {
  auto points = test::random_points<test::d3>(10);
  CHECK(count_non_finite(points) == 0);
  points(1, 3) = test::nan<double>;
  points(2, 7) = -test::infinity<double>;
  CHECK(count_non_finite(points) == 2);
}

TEST_CASE("coordinates come from lists, vectors and arrays, and fit one dimension") {
  const coordinates listed{1, 2, 3};
  CHECK(listed.as<float, 3>(3, "?") == Eigen::Vector3f{1, 2, 3});
  CHECK(coordinates{Eigen::Vector2f{4, 5}}.as<double, 2>(2, "?") == Eigen::Vector2d{4, 5});
  CHECK(coordinates{array3{7, 8, 9}}[2] == 9);
  CHECK_THROWS_WITH_AS((void)(listed.as<float, 2>(2, "two, please")), "two, please", invalid_input);
}

TEST_CASE("an image is stored row by row from the top left") {
  image<int> picture(3, 2, 7);
  picture(2, 1) = 5;
  CHECK(picture.pixels() == std::vector{7, 7, 7, 7, 7, 5});
  CHECK_THROWS_AS((image<int>(-1, 2)), invalid_input);
  CHECK(image<int>(0, 4).pixels().empty());
}
