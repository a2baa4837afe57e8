// SPDX-License-Identifier: MIT
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

template <class S>
using features = Eigen::Matrix<S, dynamic, dynamic>;

template <class S>
features<S> random_features(index_t rows, index_t count, std::uint64_t seed) {
  features<S> all(rows, count);
  random_stream random{seed};
  for (auto& x : all.reshaped()) x = S(random.uniform(0, 1));
  return all;
}

/// By comparing all with all.
template <class S>
correspondences<S> plain_matches(const features<S>& source, const features<S>& target,
                                 const match_options& options) {
  const auto is_known = [](const auto& f) { return f.allFinite() && !f.isZero(0); };
  const auto two_nearest = [&](const auto& f, const features<S>& others) {
    std::array<std::pair<double, index_t>, 2> best{{{1e300, -1}, {1e300, -1}}};
    for (index_t j = 0; j < others.cols(); ++j) {
      if (!is_known(others.col(j))) continue;
      const std::pair next{double((others.col(j) - f).norm()), j};
      if (next < best[0]) {
        best[1] = best[0];
        best[0] = next;
      } else if (next < best[1]) {
        best[1] = next;
      }
    }
    return best;
  };
  correspondences<S> pairs;
  for (index_t i = 0; i < source.cols(); ++i) {
    if (!is_known(source.col(i))) continue;
    const auto [first, second] = two_nearest(source.col(i), target);
    if (first.second < 0 || first.first > options.max_distance) continue;
    if (options.ratio < 1 && first.first > options.ratio * second.first) continue;
    if (options.mutual && two_nearest(target.col(first.second), source)[0].second != i) continue;
    pairs.push_back({std::int32_t(i), std::int32_t(first.second), S(first.first)});
  }
  return pairs;
}

}  // namespace

TEST_CASE_TEMPLATE("features are matched as comparing all with all does", S, float, double) {
  auto source = random_features<S>(33, 120, 1), target = random_features<S>(33, 90, 2);
  for (index_t i = 0; i < 40; ++i) target.col(2 * i) = source.col(i) * S(1.001);
  source.col(3).setZero();
  target.col(6).setZero();
  source(4, 7) = test::nan<S>;
  target(4, 14) = test::infinity<S>;
  for (const match_options& options :
       {match_options{}, match_options{.mutual = false}, match_options{.ratio = 0.9},
        match_options{.mutual = false, .ratio = 0.8}, match_options{.max_distance = 1.2}}) {
    const auto expected = plain_matches<S>(source, target, options);
    const auto found = match_features(source, target, options);
    REQUIRE(found.size() == expected.size());
    for (std::size_t k = 0; k < found.size(); ++k) {
      CHECK(found[k].source == expected[k].source);
      CHECK(found[k].target == expected[k].target);
      CHECK(found[k].distance == doctest::Approx(expected[k].distance));
    }
    match_options threaded = options;
    threaded.threads = 4;
    CHECK(match_features(source, target, threaded) == found);
  }
}

TEST_CASE("unknown features match nothing, not even each other") {
  features<float> unknown = features<float>::Zero(33, 5);
  unknown.col(2).setConstant(test::nan<float>);
  CHECK(match_features(unknown, unknown, {.mutual = false}).empty());
  CHECK(match_features(unknown, random_features<float>(33, 5, 1)).empty());
  CHECK(match_features(random_features<float>(33, 5, 1), unknown).empty());
  CHECK(match_features(features<float>(33, 0), features<float>(33, 0)).empty());
}

TEST_CASE("features of few dimensions, and of a dimension known at compile time, match, too") {
  const auto source = test::random_points<test::d3>(50, 1);
  const auto found = match_features(source, source);
  REQUIRE(found.size() == 50);
  for (const auto& pair : found) CHECK(pair.source == pair.target);
}

TEST_CASE("wrong options for matches get a sentence") {
  const auto some = random_features<float>(33, 5, 1);
  CHECK_THROWS_AS((void)match_features(some, random_features<float>(32, 5, 1)), invalid_input);
  CHECK_THROWS_AS((void)match_features(some, some, {.ratio = 0}), invalid_input);
  CHECK_THROWS_AS((void)match_features(some, some, {.ratio = 1.1}), invalid_input);
  CHECK_THROWS_AS((void)match_features(some, some, {.max_distance = -1}), invalid_input);
  CHECK_THROWS_AS((void)match_features(some, some, {.max_distance = test::nan<double>}),
                  invalid_input);
}
