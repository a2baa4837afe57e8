// SPDX-License-Identifier: MIT
#include <initializer_list>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

TEST_CASE("disjoint sets are named after their smallest number, whoever joined what") {
  disjoint_sets sets{6};
  sets.join(5, 4);
  sets.join(4, 2);
  sets.join(3, 1);
  CHECK(sets.find(5) == 2);
  CHECK(sets.find(3) == 1);
  CHECK(sets.find(0) == 0);
  CHECK(sets.join(5, 3));
  CHECK(!sets.join(2, 1));
  CHECK(sets.find(4) == 1);
  for (const int threads : {1, 2, 5}) {
    constexpr index_t n = 20000;
    disjoint_sets chain{n};
    // In an order that makes long paths, from several threads.
    parallel_blocks(n - 7, 16, {.threads = threads}, [&](index_t, index_t begin, index_t end) {
      for (index_t i = end - 1; i >= begin; --i) chain.join(i, i + 7);
    });
    for (index_t i = 0; i < n; ++i) REQUIRE(chain.find(i) == i % 7);
  }
  CHECK_THROWS_AS(disjoint_sets{-1}, invalid_input);
}
