// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

import cilantro;
import test_support;
using namespace cilantro;

namespace {

namespace fs = std::filesystem;

/// The same points in an order that does not depend on how they were found.
template <class S>
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
template <class S>
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

template <class S>
void check_same(const point_cloud<S, 3>& tiled, const point_cloud<S, 3>& whole) {
  REQUIRE(tiled.size() == whole.size());
  const auto a = sorted(tiled), b = sorted(whole);
  CHECK((a.points == b.points));
  CHECK((a.normals == b.normals));
  CHECK(a.attributes == b.attributes);
}

}  // namespace

TEST_CASE_TEMPLATE("each step on tiles gives the bits of the whole, for tiles of any size", S,
                   float, double) {
  const test::temporary_folder folder;
  const auto path = folder / "ground.ply";
  write_ply(terrain<S>(20'000), path);
  const auto whole = read_ply<S>(path);
  for (const double edge : {7.0, 10.0, 33.0, 1000.0}) {
    INFO(edge);
    const auto survey = open_tiles<S>(path, {.edge = edge});
    CHECK(survey.size() == 20'000);
    check_same(survey.read(), whole);
    check_same((survey | voxel_downsample(1.5)).read(), voxel_downsample(whole, 1.5));
    check_same((survey | estimate_normals(radius{1})).read(),
               estimate_normals(whole, radius{1}, {.ascending = true}));
    check_same((survey | estimate_normals(knn{10})).read(), estimate_normals(whole, knn{10}));
    check_same((survey | remove_radius_outliers({.radius = 0.5})).read(),
               remove_radius_outliers(whole, {.radius = 0.5}));
  }
}

TEST_CASE_TEMPLATE("steps after one another give the bits of the whole", S, float, double) {
  const test::temporary_folder folder;
  write_ply(terrain<S>(20'000), folder / "ground.ply");
  const auto whole = read_ply<S>(folder / "ground.ply");
  const auto steps = voxel_downsample(0.6) | remove_radius_outliers({.radius = 2}) |
                     estimate_normals(knn{12}) |
                     crop(box{.lower = {-20, -30, -9}, .upper = {60, 10, 99}});
  for (const double edge : {9.0, 40.0}) {
    const auto survey = open_tiles<S>(folder / "ground.ply", {.edge = edge});
    check_same((survey | steps).read(), whole | steps);
    check_same((survey | estimate_normals(knn{7}) | estimate_normals(knn{9})).read(),
               whole | estimate_normals(knn{7}) | estimate_normals(knn{9}));
  }
}

TEST_CASE_TEMPLATE("written tiles have all points, and open as what they were", S, float, double) {
  const test::temporary_folder folder;
  const auto cloud = terrain<S>(30'000);
  write_ply(cloud, folder / "ground.ply");
  const auto tiles = open_tiles<S>(folder / "ground.ply", {.edge = 15}) | write_tiles(folder / "t");
  CHECK(tiles.size() == 30'000);
  CHECK(tiles.edge() == 15);
  std::uint64_t total = 0;
  for (const auto& tile : tiles.tiles()) total += tile.points;
  CHECK(total == 30'000);
  check_same(tiles.read(), cloud);
  for (index_t t = 0; t < std::ssize(tiles.tiles()); ++t) {
    const auto info = tiles.tiles()[t];
    const auto points = read_ply<S>(tiles.files()[t]);
    CHECK(static_cast<std::uint64_t>(points.size()) == info.points);
    CHECK((points.points.row(0).array() >= S(info.x * 15)).all());
    CHECK((points.points.row(0).array() < S((info.x + 1) * 15)).all());
  }
  const auto again = open_tiles<S>(folder / "t");
  CHECK(again.tiles().size() == tiles.tiles().size());
  check_same((again | estimate_normals(knn{10})).read(), estimate_normals(again.read(), knn{10}));
}

TEST_CASE("what was written by steps is processed again") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(20'000), folder / "ground.ply");
  const auto whole = read_ply<float>(folder / "ground.ply");
  const auto survey = open_tiles<float>(folder / "ground.ply", {.edge = 10});
  const auto thin = survey | voxel_downsample(1) | write_tiles(folder / "thin");
  CHECK(!fs::exists(folder / "thin" / "tiles.unfinished"));
  check_same(thin.read(), voxel_downsample(whole, 1));
  const auto cloud = thin.read();
  check_same((thin | estimate_normals(knn{8})).read(), estimate_normals(cloud, knn{8}));
}
