// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <stop_token>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

using cell_members = std::map<std::vector<std::int64_t>, std::vector<std::int32_t>>;

/// The straightforward way: an ordered map from cells to their members.
template <class M>
cell_members sort_into_map(const M& points, const std::vector<double>& edges) {
  cell_members cells;
  for (index_t i = 0; i < points.cols(); ++i) {
    if (!points.col(i).allFinite()) continue;
    std::vector<std::int64_t> cell;
    for (index_t d = 0; d < points.rows(); ++d)
      cell.push_back(std::int64_t(std::floor(double(points(d, i)) / edges[std::size_t(d)])));
    cells[cell].push_back(std::int32_t(i));
  }
  return cells;
}

template <class Grid>
void expect_same(const Grid& grid, const cell_members& cells) {
  REQUIRE(grid.size() == std::ssize(cells));
  index_t c = 0;
  for (const auto& [cell, members] : cells) {
    REQUIRE(std::ranges::equal(grid[c], members));
    const auto coordinates = grid.cell(c);
    REQUIRE(std::equal(cell.begin(), cell.end(), coordinates.data()));
    REQUIRE(grid.find_cell(coordinates) == c);
    ++c;
  }
}

}  // namespace

TEST_CASE_TEMPLATE("a grid holds what an ordered map of cells would hold, in its order", T,
                   ALL_SPACES) {
  auto points = test::random_points<T>(3000, 1);
  points(0, 17) = test::nan<typename T::scalar>;
  points(1, 18) = test::infinity<typename T::scalar>;
  for (const double edge : {0.05, 0.4, 10.0})
    expect_same(voxel_grid{points, edge},
                sort_into_map(points, std::vector<double>(T::dimension, edge)));
}

TEST_CASE_TEMPLATE("cells may have another edge along each axis", T, ALL_SPACES) {
  const auto points = test::random_points<T>(2000, 2);
  std::vector<double> edges(T::dimension);
  for (std::size_t d = 0; d < edges.size(); ++d) edges[d] = 0.1 * double(d + 1);
  expect_same(voxel_grid{points, Eigen::Map<const Eigen::VectorXd>(edges.data(), T::dimension)},
              sort_into_map(points, edges));
}

TEST_CASE_TEMPLATE("cells whose coordinates need more than 64 bits together are told apart", T,
                   test::d2, test::d3, test::d5, test::dx) {
  auto points = test::random_points<T>(500, 3, -1e9, 1e9);
  points.rightCols(250) = points.leftCols(250).eval();
  expect_same(voxel_grid{points, 1e-4},
              sort_into_map(points, std::vector<double>(T::dimension, 1e-4)));
}

// The first cilantro's sums differed in the last bits between one thread and two.
TEST_CASE_TEMPLATE("downsampling has the same bits for any number of threads", T, ALL_SPACES) {
  const auto points = test::random_points<T>(20'000, 4);
  const auto one = voxel_downsample(points, 0.3, {.threads = 1});
  for (const int threads : {2, 3, 8})
    CHECK(test::same_bits(voxel_downsample(points, 0.3, {.threads = threads}), one));
}

TEST_CASE_TEMPLATE("the order of the points does not affect which cell is where", T, ALL_SPACES) {
  using S = typename T::scalar;
  const auto points = test::random_points<T>(5000, 5);
  std::vector<index_t> order(5000);
  std::iota(order.begin(), order.end(), 0);
  shuffle(order, random_stream{6});
  auto shuffled = points;
  for (index_t i = 0; i < 5000; ++i) shuffled.col(i) = points.col(order[std::size_t(i)]);
  const auto a = voxel_downsample(points, 0.4), b = voxel_downsample(shuffled, 0.4);
  REQUIRE(a.cols() == b.cols());
  // Sums of at most some hundreds of numbers up to 1 in another order, in double and then rounded.
  CHECK(double((a - b).cwiseAbs().maxCoeff()) <= std::numeric_limits<S>::epsilon() + 1e-13);
}

TEST_CASE_TEMPLATE("a downsampled point is the mean of the points in its cell", T, ALL_SPACES) {
  using S = typename T::scalar;
  const auto points = test::random_points<T>(2000, 7);
  const auto means = voxel_downsample(points, 0.5);
  const auto cells = sort_into_map(points, std::vector<double>(T::dimension, 0.5));
  REQUIRE(means.cols() == std::ssize(cells));
  index_t c = 0;
  for (const auto& [cell, members] : cells) {
    Eigen::Matrix<long double, dynamic, 1> sum =
        Eigen::Matrix<long double, dynamic, 1>::Zero(T::dimension);
    for (const auto i : members) sum += points.col(i).template cast<long double>();
    sum /= (long double)(members.size());
    CHECK(double((means.col(c).template cast<long double>() - sum).cwiseAbs().maxCoeff()) <=
          std::numeric_limits<S>::epsilon() + 1.2e-16 * double(members.size()));
    ++c;
  }
}

TEST_CASE_TEMPLATE("far from the origin a mean stays within its cell", S, float, double) {
  Eigen::Matrix<S, 3, dynamic> points = test::random_points<test::space<S, 3>>(20'000, 8, 0, 8);
  points.array() += S(1e6);
  const auto means = voxel_downsample(points, 1.0);
  for (index_t i = 0; i < means.cols(); ++i)
    for (int d = 0; d < 3; ++d) CHECK((means(d, i) >= S(1e6) && means(d, i) <= S(1e6 + 9)));
}

TEST_CASE("cells with too few points are left out") {
  const Eigen::Matrix2Xd points{{0.1, 0.2, 0.3, 1.5, 5.5, 5.6}, {0, 0, 0, 0, 0, 0}};
  CHECK(voxel_downsample(points, 1, {.min_points_per_cell = 2}).cols() == 2);
  CHECK(voxel_downsample(points, 1, {.min_points_per_cell = 3})(0, 0) == doctest::Approx(0.2));
  CHECK(voxel_downsample(points, 1, {.min_points_per_cell = 7}).cols() == 0);
  CHECK(voxel_downsample(points, 1, {.min_points_per_cell = 0}).cols() == 3);
}

TEST_CASE("negative coordinates have cells of their own: a cell never spans the origin") {
  const Eigen::Matrix2Xd points{{-0.5, 0.5, -0.1, 0.1}, {0.5, 0.5, -0.1, 0.1}};
  const voxel_grid grid{points, 1};
  CHECK(grid.size() == 3);
  CHECK(grid.cell(0) == Eigen::Matrix<std::int64_t, 2, 1>{-1, -1});
  CHECK(grid.cell(2) == Eigen::Matrix<std::int64_t, 2, 1>{0, 0});
  CHECK(std::ranges::equal(grid[2], std::array{1, 3}));
}

// The function for an index did not compile in the first cilantro.
TEST_CASE("the cell of a place, of a point and of coordinates is found, if it is occupied") {
  const auto points = test::random_points<test::f3>(500, 9);
  const voxel_grid grid{points, 0.25};
  for (std::size_t i = 0; i < 500; ++i) {
    const auto cell = grid.find(i);
    REQUIRE(cell);
    CHECK(std::ranges::count(grid[*cell], std::int32_t(i)) == 1);
    CHECK(grid.find(points.col(index_t(i))) == cell);
  }
  CHECK_FALSE(grid.find(Eigen::Vector3f{50, 0, 0}));
  CHECK_FALSE(grid.find(Eigen::Vector3f{test::nan<float>, 0, 0}));
  CHECK_FALSE(grid.find(Eigen::Vector3f{3e38f, 0, 0}));
  CHECK_FALSE(grid.find_cell({1000, 0, 0}));
  CHECK_THROWS_AS((void)grid.find(std::size_t{500}), invalid_input);
  CHECK_THROWS_AS((void)grid.find(-1), invalid_input);
}

TEST_CASE("a point in the cell of which its coordinates do not fit is named") {
  Eigen::Matrix3Xf points = test::random_points<test::f3>(10);
  points(1, 6) = 1e30f;
  CHECK_THROWS_WITH_AS((void)voxel_downsample(points, 0.001),
                       doctest::Contains("the cell of point 6 does not fit"), invalid_input);
  points(1, 6) = 1e15f;
  CHECK(voxel_downsample(points, 0.001).cols() == 10);
}

TEST_CASE("no points, and only points that are not finite, have no cells") {
  const Eigen::Matrix3Xd none(3, 0);
  CHECK(voxel_downsample(none, 1).cols() == 0);
  CHECK(voxel_grid{none, 1}.size() == 0);
  CHECK_FALSE((voxel_grid{none, 1}.find(Eigen::Vector3d{0, 0, 0})));
  const Eigen::Matrix3Xd bad = Eigen::Matrix3Xd::Constant(3, 4, test::nan<double>);
  CHECK(voxel_downsample(bad, 1).cols() == 0);
}

TEST_CASE("edges and counts that cannot be are refused") {
  const auto points = test::random_points<test::d3>(5);
  for (const double edge : {0.0, -1.0, test::nan<double>, test::infinity<double>})
    CHECK_THROWS_AS((void)voxel_downsample(points, edge), invalid_input);
  CHECK_THROWS_AS((void)voxel_downsample(points, {{1, 1}}), invalid_input);
  CHECK_THROWS_AS((void)voxel_downsample(points, {{1, 0, 1}}), invalid_input);
  CHECK_THROWS_AS((void)voxel_downsample(points, 1, {.min_points_per_cell = -1}), invalid_input);
}

TEST_CASE("a mean ignores values that are not finite, and a direction those that are unknown") {
  point_groups groups;
  groups.offsets = {0, 2, 4};
  groups.members = {0, 1, 2, 3};
  const double nan = test::nan<double>;
  const Eigen::Matrix2Xd values{{1, nan, nan, nan}, {2, 0, 1, 1}};
  const auto means = group_means(values, groups);
  CHECK(means.col(0) == Eigen::Vector2d{1, 2});
  CHECK(std::isnan(means(0, 1)));

  const Eigen::Matrix2Xd directions{{0, 0, 1, -1}, {1, 0, 0, 0}};
  const auto mean_directions = group_directions(directions, groups);
  CHECK(mean_directions.col(0) == Eigen::Vector2d{0, 1});
  CHECK(mean_directions.col(1) == Eigen::Vector2d{1, 0});
  groups.members = {0, 1, 2, 4};
  CHECK_THROWS_AS((void)group_means(values, groups), invalid_input);
}

TEST_CASE("a grid that is stopped throws `cancelled`") {
  const auto points = test::random_points<test::f3>(5000);
  std::stop_source stop;
  stop.request_stop();
  CHECK_THROWS_AS((void)voxel_downsample(points, 0.1, {.monitor = {.stop = stop.get_token()}}),
                  cancelled);
}

TEST_CASE_TEMPLATE(
    "many points in rows, on faces and in holes: every vector target cuts them alike", S, float,
    double) {
  // Enough of them to be sorted in parts; on a lattice, so that coordinates are whole multiples of
  // an edge, or nearly.
  constexpr index_t width = 300, height = 300;
  point_matrix<S, 3> points(3, width * height);
  random_stream random{5};
  for (index_t i = 0; i < points.cols(); ++i) {
    const double x = double(i % width) * 0.1, y = double(i / width) * 0.1;
    points.col(i) << S(x), S(y), S(0.1 * std::floor(10 * std::sin(x) * std::cos(y)));
    if (i % 5 == 0) points.col(i) *= S(1 + 1e-7 * random.normal());
    if (i % 1000 == 999) points(i % 3, i) = i % 2 ? test::nan<S> : test::infinity<S>;
  }
  for (const double edge : {0.1, 0.3, 0.7}) {
    const auto cells = sort_into_map(points, {edge, edge, edge});
    std::optional<point_matrix<S, 3>> means;
    for (const auto target : test::available_targets()) {
      CAPTURE(name_of(target));
      const test::using_target use{target};
      expect_same(voxel_grid{points, edge}, cells);
      expect_same(voxel_grid{points, edge, {.threads = 3}}, cells);
      const auto found = voxel_downsample(points, edge);
      if (!means) means = found;
      CHECK(found == *means);
    }
    index_t large = 0;
    for (const auto& [cell, members] : cells) large += members.size() >= 4;
    CHECK(voxel_grid{points, edge, {.min_points_per_cell = 4}}.size() == large);
  }
}
