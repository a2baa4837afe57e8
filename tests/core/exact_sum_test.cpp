// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <numeric>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

constexpr double largest = std::numeric_limits<double>::max();
constexpr double least = std::numeric_limits<double>::denorm_min();

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

template <class T>
double sum_of(const std::vector<T>& numbers) {
  exact_sum sum;
  for (const T x : numbers) sum += double(x);
  return sum.value();
}

/// Any number of the type that is finite.
template <class T, class Bits>
T any_finite(random_stream& random) {
  for (;;)
    if (const auto x = std::bit_cast<T>(static_cast<Bits>(random())); std::isfinite(x)) return x;
}

}  // namespace

// Made by a program with fractions: cases of numbers and products of all sizes, and their sum.
TEST_CASE("exact sums are the numbers that fractions give, rounded once") {
  std::ifstream file{CILANTRO_EXACT_SUMS};
  REQUIRE(file.good());
  int cases = 0;
  std::string word;
  const auto next = [&] {
    file >> word;
    return std::strtod(word.c_str(), nullptr);
  };
  for (; file >> word; ++cases) {
    const double expected = std::strtod(word.c_str(), nullptr);
    exact_sum sum;
    int count = 0;
    file >> count;
    for (int i = 0; i < count; ++i) sum += next();
    file >> count;
    for (int i = 0; i < count; ++i) {
      const double a = next(), b = next();
      sum.add_product(a, b);
    }
    CAPTURE(cases);
    CHECK(sum.value() == expected);
  }
  CHECK(cases > 50);
}

TEST_CASE("exact sums of what fits 128 bits are those of integers, at any scale") {
  random_stream random{1};
  for (const int scale : {-1074, -1100, -500, -60, 0, 800}) {
    for (int round = 0; round < 50; ++round) {
      __int128 integer = 0;
      exact_sum sum;
      for (int i = 0; i < 40; ++i) {
        const auto a = static_cast<std::int64_t>(random()) >> (11 + random.below(50));
        const auto b = static_cast<std::int64_t>(random()) >> (11 + random.below(50));
        if (i % 2 == 0) {
          integer += static_cast<__int128>(a) * b;
          sum.add_product(std::ldexp(double(a), scale / 2),
                          std::ldexp(double(b), scale - scale / 2));
        } else {
          integer += static_cast<__int128>(a) << 50;
          sum.add_product(double(a), std::ldexp(1, scale + 50));
        }
      }
      // The compiler rounds a 128-bit integer once; below 2⁻¹⁰⁷⁴ the scale would round once more.
      if (scale >= -1074 || integer % (__int128{1} << 40) == 0)
        REQUIRE(same_bits(sum.value() + 0.0, std::ldexp(static_cast<double>(integer), scale)));
    }
  }
}

TEST_CASE_TEMPLATE("neither order nor parts change an exact sum", T, float, double) {
  using bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
  random_stream random{2};
  // More than limbs take before carries.
  std::vector<T> numbers;
  for (int i = 0; i < 5000; ++i) numbers.push_back(any_finite<T, bits>(random));
  const double expected = sum_of(numbers);
  exact_sum all;
  for (const T x : numbers) all += double(x);
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    shuffle(numbers, random_stream{seed});
    CHECK(same_bits(sum_of(numbers), expected));
    for (const std::size_t part : {1u, 7u, 1000u, 4999u}) {
      exact_sum total;
      for (std::size_t begin = 0; begin < numbers.size(); begin += part) {
        exact_sum one;
        for (std::size_t i = begin; i < std::min(begin + part, numbers.size()); ++i)
          one += double(numbers[i]);
        total += one;
      }
      CHECK(same_bits(total.value(), expected));
      CHECK(total == all);
    }
  }
}

TEST_CASE("what cancels leaves nothing, and small numbers survive large ones") {
  random_stream random{3};
  std::vector<double> numbers;
  for (int i = 0; i < 3000; ++i) {
    numbers.push_back(any_finite<double, std::uint64_t>(random));
    numbers.push_back(-numbers.back());
  }
  for (int i = 0; i < 4000; ++i) numbers.push_back(largest);
  for (int i = 0; i < 4000; ++i) numbers.push_back(-largest);
  shuffle(numbers, random_stream{4});
  CHECK(same_bits(sum_of(numbers), 0.0));
  numbers.insert(numbers.begin() + 2000, least);
  CHECK(sum_of(numbers) == least);
  numbers.back() = std::nextafter(numbers.back(), 0);
  exact_sum sum, empty;
  for (const double x : numbers) sum += x;
  for (const double x : numbers) sum += -x;
  CHECK(sum == empty);
  CHECK(same_bits(empty.value(), 0.0));
}

TEST_CASE("a carry runs through all limbs, and back") {
  exact_sum sum;
  sum += largest;
  sum += std::ldexp(1, 970);  // To 2¹⁰²⁴, which is no double.
  CHECK(sum.value() == test::infinity<double>);
  sum += -least;
  CHECK(sum.value() == largest);
  sum += least;
  sum += -largest;
  CHECK(sum.value() == std::ldexp(1, 970));
  exact_sum negative;
  negative.add_product(-least, least);
  CHECK(same_bits(negative.value(), -0.0));  // Not 0, and nearer to it than to the least double.
  negative += 1;
  CHECK(negative.value() == 1);
}

TEST_CASE("infinities and NaN make of an exact sum what they make of any sum") {
  const double infinity = test::infinity<double>, nan = test::nan<double>;
  CHECK(sum_of<double>({1, infinity, 2}) == infinity);
  CHECK(sum_of<double>({-infinity, largest, largest}) == -infinity);
  CHECK(std::isnan(sum_of<double>({infinity, 1, -infinity})));
  CHECK(std::isnan(sum_of<double>({infinity, nan})));
  exact_sum sum;
  sum.add_product(-infinity, 2);
  CHECK(sum.value() == -infinity);
  sum.add_product(infinity, 0);
  CHECK(std::isnan(sum.value()));
  exact_sum other;
  other += 1;
  CHECK(other != sum);
  other += sum;
  CHECK(std::isnan(other.value()));
}

TEST_CASE("limbs of ranks are added as integers, and copied as bytes") {
  static_assert(std::is_trivially_copyable_v<exact_sum>);
  random_stream random{5};
  exact_sum all, merged;
  std::array<std::int64_t, exact_sum::limb_count> total{};
  for (int rank = 0; rank < 300; ++rank) {
    exact_sum mine;
    for (int i = 0; i < 100; ++i) {
      const double x = any_finite<double, std::uint64_t>(random);
      const double y = random.normal();
      mine += x;
      all += x;
      mine.add_product(y, y);
      all.add_product(y, y);
    }
    const auto limbs = mine.limbs();
    for (std::size_t i = 0; i < total.size(); ++i) total[i] += limbs[i];
  }
  std::ranges::copy(total, merged.limbs().begin());
  CHECK(merged == all);
  CHECK(same_bits(merged.value(), all.value()));
  CHECK(std::ranges::equal(merged.limbs(), all.limbs()));
  merged += 1;
  all += 1;
  CHECK(merged == all);
}
