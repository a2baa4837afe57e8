// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

/// How many points of a cell have each of four labels.
struct label_histogram {
  const std::vector<int>* labels;
  std::array<int, 4> counts{};
  void add(index_t i) { ++counts[std::size_t((*labels)[std::size_t(i)])]; }
  void merge(const label_histogram& later) {
    for (std::size_t l = 0; l < 4; ++l) counts[l] += later.counts[l];
  }
};
static_assert(GridAccumulator<label_histogram>);
static_assert(!GridAccumulator<int> && !GridAccumulator<std::vector<int>>);

}  // namespace

TEST_CASE_TEMPLATE("a cell gathers its points, in their order, however large it is", T,
                   ALL_SPACES) {
  const auto points = test::random_points<T>(20000, 1);
  for (const double edge : {0.3, 5.0}) {
    const voxel_grid grid{points, edge};
    for (const int threads : {1, 2, 5}) {
      const auto gathered = accumulate(grid, index_accumulator{}, {.threads = threads});
      REQUIRE(std::ssize(gathered) == grid.size());
      for (index_t c = 0; c < grid.size(); ++c)
        REQUIRE(std::ranges::equal(gathered[std::size_t(c)].indices, grid[c]));
    }
  }
}

TEST_CASE_TEMPLATE("downsampling is one model of an accumulator", T, ALL_SPACES) {
  using S = typename T::scalar;
  auto points = test::random_points<T>(6000, 2);
  auto normals = test::random_points<T>(6000, 3);
  // About the same direction, on either side.
  normals.row(0).array() = normals.row(0).array().sign() * 9;
  for (auto n : normals.colwise()) n.normalize();
  normals.col(5).setZero();
  const voxel_grid grid{points, 0.4};
  const auto means = accumulate(grid, mean_accumulator{points});
  const auto directions = accumulate(grid, direction_accumulator{normals});
  const auto expected = group_means(points, grid.groups());
  const auto expected_directions = group_directions(normals, grid.groups());
  for (index_t c = 0; c < grid.size(); ++c) {
    REQUIRE(means[std::size_t(c)].count() == std::ssize(grid[c]));
    REQUIRE(means[std::size_t(c)].mean().isApprox(expected.col(c), S(1e-5)));
    REQUIRE((directions[std::size_t(c)].direction() - expected_directions.col(c)).norm() < 1e-3);
  }
}

TEST_CASE_TEMPLATE("what is gathered has the same bits for any number of threads", T, test::f3,
                   test::dx) {
  const auto points = test::random_points<T>(50000, 4);
  const voxel_grid grid{points, 0.9};
  const auto one = accumulate(grid, mean_accumulator{points}, {.threads = 1});
  for (const int threads : {2, 5}) {
    const auto other = accumulate(grid, mean_accumulator{points}, {.threads = threads});
    for (std::size_t c = 0; c < one.size(); ++c) REQUIRE(other[c].mean() == one[c].mean());
  }
}

TEST_CASE("an accumulator of your own counts labels") {
  const auto points = test::random_points<test::f3>(30000, 5);
  std::vector<int> labels;
  for (int i = 0; i < 30000; ++i) labels.push_back(i % 7 % 4);
  const voxel_grid grid{points, 1.5};
  const auto histograms = accumulate(grid, label_histogram{&labels});
  std::array<int, 4> total{};
  for (index_t c = 0; c < grid.size(); ++c)
    for (std::size_t l = 0; l < 4; ++l) {
      CHECK(histograms[std::size_t(c)].counts[l] ==
            std::ranges::count_if(
                grid[c], [&](std::int32_t i) { return labels[std::size_t(i)] == int(l); }));
      total[l] += histograms[std::size_t(c)].counts[l];
    }
  CHECK(std::accumulate(total.begin(), total.end(), 0) == 30000);
}

TEST_CASE("grids of nothing gather nothing") {
  const Eigen::Matrix3Xf none(3, 0);
  CHECK(accumulate(voxel_grid{none, 1}, index_accumulator{}).empty());
  CHECK(nearest_to_centers(none, voxel_grid{none, 1}).empty());
}

TEST_CASE_TEMPLATE("cells lie around the origin that is given, and know where they are", T,
                   ALL_SPACES) {
  using S = typename T::scalar;
  const auto points = test::random_points<T>(500, 6);
  Eigen::VectorXd origin(T::dimension);
  for (index_t d = 0; d < T::dimension; ++d) origin[d] = 0.05 + 10 * double(d);
  const voxel_grid grid{points, 0.25, {.origin = coordinates{origin}}};
  for (index_t c = 0; c < grid.size(); ++c) {
    const auto corner = grid.corner(c);
    CHECK(((corner - origin) / 0.25).isApprox(grid.cell(c).template cast<double>()));
    CHECK(grid.center(c).isApprox(corner.array().matrix() + 0.5 * grid.edges()));
    for (const auto i : grid[c])
      for (index_t d = 0; d < T::dimension; ++d) {
        CHECK(double(points(d, i)) >= corner[d] - 1e-12);
        CHECK(double(points(d, i)) < corner[d] + 0.25 + 1e-12);
      }
    const point_vector<S, T::static_dimension> center = grid.center(c).template cast<S>();
    CHECK(grid.find(center) == std::optional{c});
  }
  CHECK_THROWS_AS((voxel_grid{points, 1, {.origin = coordinates{Eigen::VectorXd::Zero(7)}}}),
                  invalid_input);
  CHECK_THROWS_AS((voxel_grid{points,
                              1,
                              {.origin = coordinates{Eigen::VectorXd::Constant(
                                   T::dimension, test::infinity<double>)}}}),
                  invalid_input);
}

TEST_CASE_TEMPLATE("the point nearest to the centre, and the medoid of normals, are those by hand",
                   T, ALL_SPACES) {
  const auto points = test::random_points<T>(900, 7);
  auto normals = test::random_points<T>(900, 8);
  for (auto n : normals.colwise()) n.normalize();
  const voxel_grid grid{points, 0.5};
  const auto nearest = nearest_to_centers(points, grid);
  const auto medoids = medoids_of_normals(normals, grid.groups());
  const auto first = first_of_groups(grid.groups());
  for (index_t c = 0; c < grid.size(); ++c) {
    const auto at = std::size_t(c);
    CHECK(first[at] == grid[c].front());
    const auto distance = [&](std::int32_t i) {
      return (points.col(i).template cast<double>() - grid.center(c)).norm();
    };
    const auto sines = [&](std::int32_t i) {
      double sum = 0;
      for (const auto j : grid[c])
        sum += 1 - std::pow(double(normals.col(i).dot(normals.col(j))), 2);
      return sum;
    };
    for (const auto i : grid[c]) {
      CHECK(distance(nearest[at]) <= distance(i) + 1e-12);
      CHECK(sines(medoids[at]) <= sines(i) + 1e-5);
    }
  }
}

TEST_CASE("the shipped accumulators keep their contract, and a broken rule is named") {
  const auto points = test::random_points<test::d3>(100, 9);
  const auto indices = [](const index_accumulator& a) { return a.indices; };
  CHECK(check_grid_accumulator(index_accumulator{}, 100, indices).empty());
  const auto mean = [](const auto& a) { return a.mean().template cast<float>().eval(); };
  CHECK(check_grid_accumulator(mean_accumulator{points}, 100, mean).empty());
  struct forgetful : index_accumulator {
    void merge(const forgetful&) {}
  };
  CHECK(check_grid_accumulator(forgetful{}, 100, indices).size() == 3);
}
