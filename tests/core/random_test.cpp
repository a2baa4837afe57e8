// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <vector>

#include "spaces.hpp"

import cilantro;

using namespace cilantro;

// Computed apart from this code, from the description of the generator: the same numbers must come
// out of every compiler and on every machine.
TEST_CASE("a stream is a function of its seed and index alone, with published numbers") {
  random_stream zero{0};
  CHECK(zero() == 0x9c8cb388e19b65a9u);
  CHECK(zero() == 0x48b0b3c0e65e1c9u);
  random_stream other{42, 7};
  CHECK(other() == 0x3386a780aa5d4671u);
  CHECK(other() == 0xb9e906ab6bbede3cu);
}

TEST_CASE("uniform numbers fill [0, 1) evenly, also across indices") {
  std::array<int, 10> along{}, across{};
  random_stream random{1};
  for (std::uint64_t i = 0; i < 100'000; ++i) {
    const double u = random.uniform();
    REQUIRE((0 <= u && u < 1));
    ++along[static_cast<std::size_t>(u * 10)];
    ++across[static_cast<std::size_t>(random_stream{1, i}.uniform() * 10)];
  }
  // Five standard deviations of a bin: √(100,000 · 0.1 · 0.9) ≈ 95.
  for (const int count : along) CHECK(std::abs(count - 10'000) < 475);
  for (const int count : across) CHECK(std::abs(count - 10'000) < 475);
}

TEST_CASE("an integer below n takes each value equally often") {
  std::array<int, 7> counts{};
  random_stream random{3};
  for (int i = 0; i < 70'000; ++i) ++counts[static_cast<std::size_t>(random.below(7))];
  for (const int count : counts) CHECK(std::abs(count - 10'000) < 475);
  CHECK(random.below(1) == 0);
  CHECK_THROWS_AS((void)random.below(0), invalid_input);
}

TEST_CASE("normal numbers have mean 0 and variance 1") {
  random_stream random{5};
  double sum = 0, squares = 0;
  for (int i = 0; i < 100'000; ++i) {
    const double x = random.normal();
    sum += x;
    squares += x * x;
  }
  CHECK(std::abs(sum / 1e5) < 0.016);
  CHECK(std::abs(squares / 1e5 - 1) < 0.025);
}

TEST_CASE("a sample has different indices, ascending, and each is as likely as the others") {
  for (const index_t count : {0, 1, 5, 300, 1000})
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      const auto sample = distinct_sample(1000, count, random_stream{seed});
      CHECK(std::ssize(sample) == count);
      CHECK(std::ranges::adjacent_find(sample, std::ranges::greater_equal{}) == sample.end());
      CHECK(std::ranges::all_of(sample, [](index_t i) { return 0 <= i && i < 1000; }));
    }
  std::map<index_list, int> seen;
  for (std::uint64_t i = 0; i < 30'000; ++i) ++seen[distinct_sample(5, 2, random_stream{9, i})];
  CHECK(seen.size() == 10);
  for (const auto& [sample, count] : seen) CHECK(std::abs(count - 3000) < 260);
  CHECK_THROWS_AS((void)distinct_sample(3, 4, random_stream{0}), invalid_input);
  CHECK_THROWS_AS((void)distinct_sample(3, -1, random_stream{0}), invalid_input);
}

TEST_CASE("a shuffle is a permutation, and every one is as likely as the others") {
  std::map<std::array<int, 3>, int> seen;
  for (std::uint64_t i = 0; i < 30'000; ++i) {
    std::array order{0, 1, 2};
    shuffle(order, random_stream{11, i});
    ++seen[order];
  }
  CHECK(seen.size() == 6);
  for (const auto& [order, count] : seen) CHECK(std::abs(count - 5000) < 325);
  std::vector<int> none;
  shuffle(none, random_stream{0});
  CHECK(none.empty());
}
