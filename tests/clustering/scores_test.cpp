// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "spaces.hpp"

import cilantro;
import clustering_support;
import test_support;

using namespace cilantro;
using labels = std::vector<std::int32_t>;

TEST_CASE("the adjusted Rand index has its textbook values") {
  CHECK(adjusted_rand_index(labels{0, 0, 1, 1}, labels{5, 5, -1, -1}) == 1);
  CHECK(adjusted_rand_index(labels{0, 0, 1, 2}, labels{0, 0, 1, 1}) == doctest::Approx(4.0 / 7));
  CHECK(adjusted_rand_index(labels{0, 0, 0, 0}, labels{0, 1, 2, 3}) == 0);
  CHECK(adjusted_rand_index(labels{0, 1, 0, 1}, labels{0, 0, 1, 1}) == doctest::Approx(-0.5));
  CHECK(adjusted_rand_index(labels{}, labels{}) == 1);
  CHECK(adjusted_rand_index(labels{3}, labels{1}) == 1);
  CHECK_THROWS_AS((void)adjusted_rand_index(labels{0}, labels{}), invalid_input);
}

TEST_CASE("normalised mutual information is 1 for the same, 0 for the independent") {
  CHECK(normalized_mutual_information(labels{0, 0, 1, 1}, labels{1, 1, 0, 0}) ==
        doctest::Approx(1));
  CHECK(normalized_mutual_information(labels{0, 1, 0, 1}, labels{0, 0, 1, 1}) ==
        doctest::Approx(0));
  // I = ln 2, H = 1.5 ln 2 and ln 2.
  CHECK(normalized_mutual_information(labels{0, 0, 1, 2}, labels{0, 0, 1, 1}) ==
        doctest::Approx(0.8));
  CHECK(normalized_mutual_information(labels{7, 7}, labels{1, 1}) == 1);
  CHECK_THROWS_AS((void)normalized_mutual_information(labels{0}, labels{}), invalid_input);
}

TEST_CASE_TEMPLATE("silhouettes are those of their definition", T, ALL_SPACES) {
  using S = typename T::scalar;
  auto points = test::random_points<T>(60, 2);
  points(0, 5) = test::nan<S>;
  labels of;
  for (int i = 0; i < 60; ++i) of.push_back(i % 4 == 3 ? (i == 59 ? 3 : -1) : i % 4);
  const auto all = silhouettes(points, of);
  const auto by_hand = [&](index_t i) {
    if (of[std::size_t(i)] < 0 || i == 5 || i == 59) return 0.0;
    std::vector<double> sum(4), count(4);
    for (index_t j = 0; j < 60; ++j) {
      if (of[std::size_t(j)] < 0 || j == 5 || j == i) continue;
      sum[std::size_t(of[std::size_t(j)])] += double((points.col(i) - points.col(j)).norm());
      ++count[std::size_t(of[std::size_t(j)])];
    }
    double a = 0, b = 1e9;
    for (std::size_t c = 0; c < 4; ++c) {
      if (std::int32_t(c) == of[std::size_t(i)])
        a = sum[c] / count[c];
      else
        b = std::min(b, sum[c] / count[c]);
    }
    return (b - a) / std::max(a, b);
  };
  double sum = 0;
  for (index_t i = 0; i < 60; ++i) {
    CHECK(all[std::size_t(i)] == doctest::Approx(by_hand(i)).epsilon(1e-5));
    sum += by_hand(i);
  }
  CHECK(silhouette(points, of) == doctest::Approx(sum / 46).epsilon(1e-4));
  CHECK(silhouettes(points, of, {.threads = 5}) == silhouettes(points, of, {.threads = 1}));
  CHECK(silhouette(points, labels(60, 0)) == 0);
  CHECK(silhouette(points, labels(60, -1)) == 0);
  CHECK_THROWS_AS((void)silhouettes(points, labels(59, 0)), invalid_input);
}
