// SPDX-License-Identifier: MIT
#include <algorithm>
#include <iterator>
#include <ranges>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

static_assert(std::ranges::random_access_range<neighborhood<float>>);
static_assert(std::ranges::borrowed_range<neighborhood<float>>);
static_assert(std::ranges::random_access_range<const neighborhoods<float>>);

TEST_CASE("neighborhoods are a range of ranges over three arrays") {
  const neighborhoods<float> all{{0, 2, 2, 3}, {7, 4, 1}, {0.5f, 1, 2}};
  CHECK(all.size() == 3);
  CHECK(all.total() == 3);
  CHECK(all[0].size() == 2);
  CHECK(all[1].empty());
  CHECK(all[0][1] == neighbor<float>{4, 1});
  CHECK(all[0].indices().data() == all.indices().data());
  std::vector<index_t> counts;
  for (const auto& near : all) counts.push_back(std::ssize(near));
  CHECK(counts == std::vector<index_t>{2, 0, 1});
  CHECK(std::ranges::count_if(all[0], [](const auto& n) { return n.distance < 0.75f; }) == 1);
  CHECK(all[0].end()[-1].index == 4);
}

TEST_CASE("neighborhoods of nothing are empty") {
  const neighborhoods<double> none;
  CHECK(none.empty());
  CHECK(none.total() == 0);
  CHECK(none.begin() == none.end());
}

TEST_CASE("offsets that do not fit the arrays are refused") {
  using all = neighborhoods<float>;
  CHECK_THROWS_AS(all({0, 2}, {1}, {1}), invalid_input);
  CHECK_THROWS_AS(all({0, 2, 1}, {1}, {1}), invalid_input);
  CHECK_THROWS_AS(all({1, 1}, {1}, {1}), invalid_input);
  CHECK_THROWS_AS(all({}, {}, {}), invalid_input);
  CHECK_THROWS_AS(all({0, 1}, {1}, {}), invalid_input);
}

TEST_CASE("any searcher answers many queries, as many threads as there are") {
  const auto points = test::random_points<test::d3>(400);
  const brute_force_searcher brute{points};
  const kd_tree tree{points};
  for (const int threads : {1, 3}) {
    const auto a = find_neighborhoods(brute, points, knn{6}, {.threads = threads});
    const auto b = find_neighborhoods(tree, points, knn{6}, {.threads = threads});
    CHECK(std::ranges::equal(a.offsets(), b.offsets()));
    CHECK(std::ranges::equal(a.indices(), b.indices()));
    CHECK(std::ranges::equal(a.distances(), b.distances()));
  }
}
