// SPDX-License-Identifier: MIT
#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

TEST_CASE("every index is visited once, for any count and number of threads") {
  for (const index_t n : {0, 1, 2, 1023, 1024, 1025, 10'000})
    for (const int threads : {0, 1, 2, 7}) {
      std::vector<int> visits(static_cast<std::size_t>(n));
      parallel_for(n, {.threads = threads}, [&](index_t i) { ++visits[std::size_t(i)]; });
      CHECK(std::ranges::all_of(visits, [](int v) { return v == 1; }));
    }
}

TEST_CASE("blocks are consecutive and of the asked size, the last one of what remains") {
  std::vector<index_t> begins(4), ends(4);
  parallel_blocks(10, 3, {.threads = 2}, [&](index_t b, index_t begin, index_t end) {
    begins[std::size_t(b)] = begin;
    ends[std::size_t(b)] = end;
  });
  CHECK(begins == std::vector<index_t>{0, 3, 6, 9});
  CHECK(ends == std::vector<index_t>{3, 6, 9, 10});
}

TEST_CASE_TEMPLATE("a sum has the same bits for any number of threads", S, float, double) {
  const auto values = test::random_points<test::space<S, 2>>(100'003, 1, -1e3, 1e3);
  const auto sum_with = [&](int threads) {
    return ordered_sum(values.cols(), {.threads = threads}, S(0),
                       [&](S& sum, index_t i) { sum += values(0, i); });
  };
  const S one = sum_with(1);
  for (const int threads : {2, 3, 8}) CHECK(sum_with(threads) == one);
  // And it is a sum: as close to the exact one as its blocks allow.
  double exact = 0;
  for (index_t i = 0; i < values.cols(); ++i) exact += double(values(0, i));
  CHECK(double(one) == doctest::Approx(exact).epsilon(sizeof(S) == 4 ? 1e-3 : 1e-12));
}

TEST_CASE("of several exceptions the one of the lowest index reaches the caller") {
  for (const int threads : {1, 2, 4})
    for (int repeat = 0; repeat < 20; ++repeat)
      CHECK_THROWS_WITH(parallel_for(50'000, {.threads = threads},
                                     [](index_t i) {
                                       if (i == 7777 || i == 30'000 || i == 49'999)
                                         throw std::runtime_error{std::to_string(i)};
                                     }),
                        "7777");
}

TEST_CASE("negative counts and threads are refused") {
  const auto nothing = [](index_t) {};
  CHECK_THROWS_AS(parallel_for(10, {.threads = -1}, nothing), invalid_input);
  CHECK_THROWS_AS(parallel_for(-1, {}, nothing), invalid_input);
  CHECK_THROWS_AS(parallel_blocks(5, 0, {}, [](index_t, index_t, index_t) {}), invalid_input);
}

TEST_CASE("a stop that was requested before ends the call with `cancelled` and without work") {
  std::stop_source stop;
  stop.request_stop();
  std::atomic<int> calls = 0;
  CHECK_THROWS_AS(
      parallel_for(100'000, {.monitor = {.stop = stop.get_token()}}, [&](index_t) { ++calls; }),
      cancelled);
  CHECK(calls == 0);
}

TEST_CASE("a stop during the call leaves most of the work undone") {
  for (const int threads : {1, 2}) {
    std::stop_source stop;
    std::atomic<int> calls = 0;
    CHECK_THROWS_AS(
        parallel_for(1'000'000, {.threads = threads, .monitor = {.stop = stop.get_token()}},
                     [&](index_t) {
                       if (++calls == 5000) stop.request_stop();
                     }),
        cancelled);
    CHECK(calls < 100'000);
  }
}

TEST_CASE("progress rises to 1, on the calling thread only") {
  for (const int threads : {1, 2, 4}) {
    std::vector<double> seen;
    bool elsewhere = false;
    const auto caller = std::this_thread::get_id();
    const task_monitor monitor{.progress = [&](double share) {
      elsewhere = elsewhere || std::this_thread::get_id() != caller;
      seen.push_back(share);
    }};
    parallel_for(50'000, {.threads = threads, .monitor = monitor}, [](index_t) {});
    CHECK_FALSE(elsewhere);
    REQUIRE_FALSE(seen.empty());
    CHECK(std::ranges::is_sorted(seen));
    CHECK(seen.front() > 0);
    CHECK(seen.back() == 1);
  }
}

TEST_CASE("parallel loops nest") {
  std::atomic<int> calls = 0;
  parallel_for(8, {}, [&](index_t) { parallel_for(3000, {}, [&](index_t) { ++calls; }); });
  CHECK(calls == 24'000);
}
