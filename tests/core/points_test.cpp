// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>
#include <array>
#include <vector>

import cilantro;
TEST_CASE("x") {
  std::vector<std::array<float, 3>> v{{1, 2, 3}, {4, 5, 6}};
  auto p = cilantro::as_points(v);
  CHECK(p.size() == 2);
  CHECK(p[1].y() == 5);
  CHECK_THROWS_AS(cilantro::expects(false, "hm"), cilantro::invalid_input);
  auto sum = cilantro::ordered_sum(5000, {.threads = 2}, 0.0, [](double& s, cilantro::index_t i) { s += i; });
  CHECK(sum == 5000.0 * 4999 / 2);
}
