// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <set>
#include <span>
#include <stop_token>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

template <class T>
auto scan(std::uint64_t seed) {
  auto points = test::random_points<T>(800, seed);
  points.leftCols(20) *= typename T::scalar(4);
  points(0, 33) = test::nan<typename T::scalar>;
  points(1, 34) = test::infinity<typename T::scalar>;
  return points;
}

/// The distances to the others, ascending, by looking at all.
template <class M>
std::vector<double> distances_to_others(const M& points, index_t i) {
  std::vector<double> all;
  for (index_t j = 0; j < points.cols(); ++j)
    if (j != i && points.col(j).allFinite())
      all.push_back(double((points.col(i) - points.col(j)).norm()));
  std::ranges::sort(all);
  return all;
}

}  // namespace

TEST_CASE_TEMPLATE("statistical outliers are those of the definition", T, ALL_SPACES) {
  const auto points = scan<T>(1);
  std::vector<double> means;
  double sum = 0, squares = 0;
  for (index_t i = 0; i < points.cols(); ++i) {
    if (!points.col(i).allFinite()) {
      means.push_back(test::nan<double>);
      continue;
    }
    const auto all = distances_to_others(points, i);
    double mean = 0;
    for (std::size_t k = 0; k < 15; ++k) mean += all[k] / 15;
    means.push_back(mean);
    sum += mean;
    squares += mean * mean;
  }
  const double n = 798, mean = sum / n,
               deviation = std::sqrt((squares - n * mean * mean) / (n - 1));
  std::vector<std::int32_t> kept, removed;
  for (std::int32_t i = 0; i < 800; ++i)
    (means[std::size_t(i)] <= mean + 1.5 * deviation ? kept : removed).push_back(i);
  const auto found = statistical_outliers(points, {.neighbors = 15, .deviations = 1.5});
  CHECK(found.kept == kept);
  CHECK(found.removed == removed);
  CHECK(removed.size() > 10);
  for (const int threads : {1, 2, 5})
    CHECK(statistical_outliers(points, {.neighbors = 15, .deviations = 1.5, .threads = threads})
              .kept == kept);
}

TEST_CASE_TEMPLATE("the limit of statistical outliers depends neither on order nor on parts", T,
                   ALL_SPACES) {
  using S = typename T::scalar;
  const auto points = scan<T>(4);
  const auto distances = mean_neighbor_distances(points, 12);
  REQUIRE(distances.size() == 800);
  CHECK(std::isnan(distances[33]));
  CHECK(std::isnan(distances[34]));
  for (const std::size_t i : {0u, 500u}) {
    const auto all = distances_to_others(points, index_t(i));
    double mean = 0;
    for (std::size_t k = 0; k < 12; ++k) mean += all[k] / 12;
    CHECK(distances[i] == doctest::Approx(mean).epsilon(1e-5));
  }
  const double epsilon = double(std::numeric_limits<S>::epsilon());
  const auto whole = statistics_of(distances);
  const double limit = whole.limit(1.5, epsilon);
  CHECK(whole.count == 798);
  const auto found = statistical_outliers(points, {.neighbors = 12, .deviations = 1.5});
  for (const auto i : found.kept) CHECK(distances[std::size_t(i)] <= limit);
  for (const auto i : found.removed) CHECK_FALSE(distances[std::size_t(i)] <= limit);
  auto shuffled = distances;
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    shuffle(shuffled, random_stream{seed});
    CHECK(statistics_of(shuffled, {.threads = int(seed)}).limit(1.5, epsilon) == limit);
    distance_statistics parts;
    for (const auto& [begin, count] : {std::pair{300, 500}, {0, 7}, {7, 293}})
      parts += statistics_of(std::span{shuffled}.subspan(std::size_t(begin), std::size_t(count)));
    CHECK(parts.count == 798);
    CHECK(parts.limit(1.5, epsilon) == limit);
  }
}

TEST_CASE("a limit loses nothing where all distances are nearly the same, and far from 0") {
  // Their deviation is half of the last place: every sum of squares in doubles would miss it.
  distance_statistics statistics;
  CHECK(statistics.limit(2, 0) == 0);
  const double next = std::nextafter(1e6, 2e6);
  for (int i = 0; i < 1000; ++i) statistics.add(i % 2 == 0 ? 1e6 : next);
  const double step = next - 1e6, deviation = step / 2 * std::sqrt(1000.0 / 999);
  CHECK(statistics.limit(1e6, 0) == doctest::Approx(1e6 + 1e6 * deviation).epsilon(1e-15));
  CHECK(statistics.limit(0, 0) >= 1e6);
  CHECK(statistics.limit(0, 0) <= next);
  statistics.add(test::infinity<double>);
  CHECK(statistics.limit(2, 0) == test::infinity<double>);
  distance_statistics far;
  for (const double distance : {1e200, 2e200, 3e200}) far.add(distance);
  CHECK(far.limit(1, 0) == test::infinity<double>);  // Their squares are no doubles.
}

TEST_CASE_TEMPLATE("radius outliers are those of the definition", T, ALL_SPACES) {
  const auto points = scan<T>(2);
  for (const index_t least : {0, 1, 6}) {
    std::vector<std::int32_t> kept;
    for (index_t i = 0; i < 800; ++i) {
      if (!points.col(i).allFinite()) continue;
      const auto all = distances_to_others(points, i);
      if (std::ranges::count_if(all, [](double d) { return d <= 0.3; }) >= least)
        kept.push_back(std::int32_t(i));
    }
    const auto found = radius_outliers(points, {.radius = 0.3, .min_neighbors = least});
    CHECK(found.kept == kept);
    CHECK(found.kept.size() + found.removed.size() == 800);
  }
}

TEST_CASE("few, equal and evenly spaced points are no outliers") {
  CHECK(statistical_outliers(Eigen::Matrix3Xf(3, 0)).kept.empty());
  CHECK(statistical_outliers(Eigen::Matrix3Xf::Ones(3, 1).eval()).kept.size() == 1);
  CHECK(statistical_outliers(Eigen::Matrix3Xf::Ones(3, 50).eval(), {.deviations = 0}).kept.size() ==
        50);
  Eigen::Matrix<double, 1, -1, Eigen::RowMajor> circle(1, 2);
  circle << 0.1, 0.4;
  CHECK(statistical_outliers(circle, {.deviations = 0}).kept.size() == 2);
  CHECK(radius_outliers(Eigen::Matrix3Xf::Ones(3, 3).eval(), {.radius = 1e-9}).kept.size() == 3);
  CHECK(radius_outliers(Eigen::Matrix3Xf::Ones(3, 2).eval(), {.radius = 1e-9}).kept.empty());
  CHECK_THROWS_AS((void)radius_outliers(circle, {.radius = 0}), invalid_input);
}

TEST_CASE("filters refuse what makes no sense, and can be stopped") {
  const auto points = test::random_points<test::f3>(5000);
  CHECK_THROWS_AS((void)statistical_outliers(points, {.neighbors = 0}), invalid_input);
  CHECK_THROWS_AS((void)statistical_outliers(points, {.deviations = -1}), invalid_input);
  CHECK_THROWS_AS((void)radius_outliers(points, {.radius = test::nan<double>}), invalid_input);
  CHECK_THROWS_AS((void)radius_outliers(points, {.radius = 1, .min_neighbors = -1}), invalid_input);
  std::stop_source stop;
  stop.request_stop();
  CHECK_THROWS_AS((void)statistical_outliers(points, {.monitor = {.stop = stop.get_token()}}),
                  cancelled);
  CHECK_THROWS_AS((void)farthest_point_sample(points, 9, {.monitor = {.stop = stop.get_token()}}),
                  cancelled);
}

TEST_CASE("random samples are distinct, sorted, seeded, and any point may be in them") {
  std::set<std::int32_t> seen;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const auto sample = random_indices(50, 7, seed);
    CHECK(sample.size() == 7);
    CHECK(std::ranges::adjacent_find(sample, std::ranges::greater_equal{}) == sample.end());
    CHECK(sample == random_indices(50, 7, seed));
    seen.insert(sample.begin(), sample.end());
  }
  CHECK(seen.size() == 50);
  CHECK(random_indices(5, 9).size() == 5);
  CHECK(random_indices(0, 3).empty());
  CHECK_THROWS_AS((void)random_indices(5, -1), invalid_input);
}

TEST_CASE("uniform samples are at equal steps") {
  CHECK(uniform_indices(10, 4) == std::vector<std::int32_t>{0, 2, 5, 7});
  CHECK(uniform_indices(10, 10).size() == 10);
  CHECK(uniform_indices(3, 10) == std::vector<std::int32_t>{0, 1, 2});
  CHECK(uniform_indices(10, 0).empty());
  CHECK_THROWS_AS((void)uniform_indices(10, -2), invalid_input);
}

TEST_CASE_TEMPLATE("each farthest point is the farthest from all before it", T, ALL_SPACES) {
  const auto points = scan<T>(3);
  const auto sample = farthest_point_sample(points, 40, {.first = 33});
  REQUIRE(sample.size() == 40);
  CHECK(sample[0] == 35);
  for (std::size_t s = 1; s < sample.size(); ++s) {
    const auto distance = [&](index_t i) {
      double least = test::infinity<double>;
      for (std::size_t t = 0; t < s; ++t)
        least = std::min(least, (points.col(i).template cast<double>() -
                                 points.col(sample[t]).template cast<double>())
                                    .squaredNorm());
      return least;
    };
    for (index_t i = 0; i < 800; ++i)
      if (points.col(i).allFinite())
        REQUIRE((distance(i) < distance(sample[s]) ||
                 (distance(i) == distance(sample[s]) && sample[s] <= i)));
  }
  for (const int threads : {1, 2, 5})
    CHECK(farthest_point_sample(points, 40, {.first = 33, .threads = threads}) == sample);
}

TEST_CASE("farthest points of few or equal points are all of them, once") {
  const auto same = farthest_point_sample(Eigen::Matrix3Xf::Ones(3, 5).eval(), 9);
  CHECK(same == std::vector<std::int32_t>{0, 1, 2, 3, 4});
  CHECK(farthest_point_sample(Eigen::Matrix3Xf(3, 0), 9).empty());
  CHECK(
      farthest_point_sample(Eigen::Matrix3Xf::Constant(3, 4, test::nan<float>).eval(), 9).empty());
  CHECK_THROWS_AS((void)farthest_point_sample(Eigen::Matrix3Xf(3, 2), -1), invalid_input);
  CHECK_THROWS_AS((void)farthest_point_sample(Eigen::Matrix3Xf(3, 2), 1, {.first = 2}),
                  invalid_input);
}
