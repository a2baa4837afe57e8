// SPDX-License-Identifier: MIT
#include <cstdint>
#include <mutex>
#include <set>
#include <stdexcept>

#include "spaces.hpp"

import cilantro;
import rank_support;

TEST_CASE("ranks that are threads do what ranks must do, and the same for any number") {
  for (const int size : {1, 2, 3, 4, 8}) {
    test::in_process_ranks ranks{size};
    std::mutex mutex;
    std::set<std::uint64_t> hashes;
    ranks.run([&](auto& rank) {
      const std::uint64_t hash = test::check_ranks(rank, 100'000);
      const std::lock_guard lock{mutex};
      hashes.insert(hash);
    });
    CHECK(hashes.size() == 1);
  }
}

TEST_CASE("a thread that is a rank and throws ends the others, and is named") {
  test::in_process_ranks ranks{3};
  CHECK_THROWS_WITH(ranks.run([](auto& rank) {
    if (rank.rank() == 1) throw std::runtime_error{"no such tile"};
    (void)rank.all_gather({});
  }),
                    "rank 1: no such tile");
  test::in_process_ranks others{2};
  CHECK_THROWS_WITH(others.run([](auto& rank) { rank.deal(rank.rank()); }),
                    "rank 0: deal 0, but another: deal 1");
}
