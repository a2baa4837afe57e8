// SPDX-License-Identifier: MIT
//
// Which concepts of the standard library the types of this module model.
#include <algorithm>
#include <concepts>
#include <iterator>
#include <ranges>
#include <vector>

#include "spaces.hpp"

import cilantro.search;
import test_support;

using namespace cilantro;
namespace ranges = std::ranges;

template <class T>
constexpr bool is_indexed_range = ranges::random_access_range<const T> &&
                                  ranges::sized_range<const T> && ranges::common_range<const T>;

static_assert(is_indexed_range<neighborhood<float>>);
static_assert(ranges::view<neighborhood<float>> && ranges::borrowed_range<neighborhood<float>>);
static_assert(std::same_as<ranges::range_value_t<neighborhood<float>>, neighbor<float>>);
// These own what they hold, so that none of their rows outlives them.
static_assert(is_indexed_range<neighborhoods<double>>);
static_assert(!ranges::view<neighborhoods<double>> &&
              !ranges::borrowed_range<neighborhoods<double>>);
static_assert(std::same_as<ranges::range_value_t<neighborhoods<double>>, neighborhood<double>>);
static_assert(is_indexed_range<neighborhood_block<float>>);
static_assert(std::same_as<ranges::range_value_t<neighborhood_block<float>>, neighborhood<float>>);

TEST_CASE("neighbourhoods go through the views of the standard library") {
  const Eigen::Matrix3Xf points = test::random_points<test::f3>(60);
  const auto near = find_neighborhoods(kd_tree{points}, points, radius{0.4});
  index_t pairs = 0;
  for (const auto& [index, distance] : near | std::views::drop(10) | std::views::join) {
    CHECK((0 <= index && index < 60 && distance <= 0.4f));
    ++pairs;
  }
  CHECK(pairs == near.total() - near.offsets()[10]);
  const auto largest =
      ranges::max_element(near, {}, [](const auto& some) { return std::ssize(some); });
  CHECK(ranges::all_of(near, [&](const auto& some) { return some.size() <= (*largest).size(); }));
  // A neighbourhood as points: of what its indices say.
  const auto first = near[0].indices() |
                     std::views::transform([&](auto i) { return points.col(i); }) | to_points();
  CHECK(first.cols() == std::ssize(near[0]));
  CHECK(first.col(0) == points.col(0));
}
