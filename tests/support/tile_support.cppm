// SPDX-License-Identifier: MIT
//
// What the tests of tiles share.
module;
#include <doctest/doctest.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tuple>
#include <utility>
#include <vector>
export module tile_support;

import cilantro;
using namespace cilantro;

namespace test {

/// The same points in an order that does not depend on how they were found.
export template <class S>
point_cloud<S, 3> sorted(const point_cloud<S, 3>& cloud) {
  index_list order(cloud.size());
  for (index_t i = 0; i < cloud.size(); ++i) order[i] = static_cast<std::int32_t>(i);
  const auto less = [&](std::int32_t i, std::int32_t j) {
    const auto &p = cloud.points.col(i), &q = cloud.points.col(j);
    return std::tuple{p[0], p[1], p[2], i} < std::tuple{q[0], q[1], q[2], j};
  };
  std::sort(order.begin(), order.end(), less);
  return select(cloud, order);
}

/// Points of a hilly ground with some above it, of very different density, with negative
/// coordinates, duplicates, and points exactly on borders of tiles.
export template <class S>
point_cloud<S, 3> terrain(index_t n, std::uint32_t seed = 1) {
  point_cloud<S, 3> cloud;
  cloud.points.resize(3, n);
  std::uint64_t state = seed;
  const auto uniform = [&] {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return double(state >> 11) * 0x1p-53;
  };
  for (index_t i = 0; i < n; ++i) {
    double x = 100 * uniform() - 30, y = 60 * uniform() - 40;
    if (uniform() < 0.3) x = 5 + 2 * uniform(), y = 3 * uniform();  // Dense.
    double z = std::sin(0.1 * x) + std::cos(0.2 * y) + 0.02 * uniform();
    if (uniform() < 0.002) z += 40 * uniform();  // Birds.
    if (uniform() < 0.01) x = 10 * std::floor(x / 10);
    cloud.points.col(i) << S(x), S(y), S(z);
    if (i > 0 && uniform() < 0.01) cloud.points.col(i) = cloud.points.col(i - 1);
  }
  std::vector<std::uint16_t> number(n);
  for (index_t i = 0; i < n; ++i) number[i] = static_cast<std::uint16_t>(i);
  cloud.set_attribute("number", attribute_values{number});
  return cloud;
}

export template <class S>
void check_same(const point_cloud<S, 3>& tiled, const point_cloud<S, 3>& whole) {
  REQUIRE(tiled.size() == whole.size());
  const auto a = sorted(tiled), b = sorted(whole);
  CHECK((a.points == b.points));
  CHECK((a.normals == b.normals));
  CHECK(a.attributes == b.attributes);
}

}  // namespace test
