// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

import cilantro;
import test_support;
import rank_support;
import tile_support;
using namespace cilantro;
using test::check_same;
using test::terrain;

namespace {

template <class S>
point_cloud<S, 3> labelled(point_cloud<S, 3> cloud, const clusters& found) {
  cloud.set_attribute("cluster", found.labels());
  return cloud;
}

}  // namespace

TEST_CASE_TEMPLATE("components across tiles have the numbers that they have at once", S, float,
                   double) {
  const test::temporary_folder folder;
  write_ply(terrain<S>(12'000), folder / "ground.ply");
  const auto whole = read_ply<S>(folder / "ground.ply");
  int run = 0;
  for (const double distance : {0.3, 0.45, 0.8})
    for (const double edge : {6.0, 25.0}) {
      INFO(distance, " ", edge);
      const auto survey = open_tiles<S>(folder / "ground.ply", {.edge = edge});
      const auto out = folder / std::to_string(run++);
      const auto expected = connected_components(whole, radius{distance});
      CHECK(expected.size() > 5);
      check_same((survey | write_clusters(out, radius{distance})).read(),
                 labelled(whole, expected));
    }
  const components_options sizes{.min_cluster_size = 4, .max_cluster_size = 500};
  const auto survey = open_tiles<S>(folder / "ground.ply", {.edge = 9});
  check_same((survey | write_clusters(folder / "sizes", radius{0.4}, sizes)).read(),
             labelled(whole, connected_components(whole, radius{0.4}, sizes)));
  CHECK_THROWS_AS((void)write_clusters(folder / "x", radius{0.0}), invalid_input);
  CHECK_THROWS_AS((void)write_clusters(folder / "x", radius{1}, {.seeds = index_list{1}}),
                  invalid_input);
}

TEST_CASE_TEMPLATE("density-based clusters across tiles are those of the whole", S, float, double) {
  const test::temporary_folder folder;
  write_ply(terrain<S>(12'000), folder / "ground.ply");
  const auto whole = read_ply<S>(folder / "ground.ply");
  int run = 0;
  for (const index_t least : {1, 4, 9})
    for (const double edge : {6.0, 25.0}) {
      INFO(least, " ", edge);
      const dbscan_options how{.radius = 0.7, .min_points = least};
      const auto survey = open_tiles<S>(folder / "ground.ply", {.edge = edge});
      const auto expected = dbscan(whole, how);
      CHECK(expected.size() > 3);
      check_same((survey | write_clusters(folder / std::to_string(run++), how)).read(),
                 labelled(whole, expected));
    }
}

TEST_CASE("clusters of what steps give, by any number of ranks, are the same") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(12'000), folder / "ground.ply");
  const auto steps = voxel_downsample(0.4) | remove_statistical_outliers({.neighbors = 6});
  const dbscan_options how{.radius = 0.9, .min_points = 4};
  const auto alone = open_tiles<float>(folder / "ground.ply", {.edge = 11}) | steps |
                     write_clusters(folder / "alone", how);
  const auto whole = read_ply<float>(folder / "ground.ply") | steps;
  check_same(alone.read(), labelled(whole, dbscan(whole, how)));
  for (const int count : {2, 5}) {
    const auto out = folder / ("ranks" + std::to_string(count));
    test::in_process_ranks job{count};
    job.run([&](auto& world) {
      (void)(open_tiles<float>(folder / "ground.ply", {.edge = 11, .threads = 1}).on(world) |
             steps | write_clusters(out, how));
    });
    CHECK(open_tiles<float>(out).read() == alone.read());
    for (const auto& entry : std::filesystem::directory_iterator{out})
      CHECK((entry.path().extension() == ".ply" || entry.path().filename() == "tiles.index"));
  }
}

TEST_CASE_TEMPLATE("equally large clusters behind steps have the numbers of the whole", S, float,
                   double) {
  const test::temporary_folder folder;
  // Pairs that are far from each other, in an order that has nothing to do with tiles.
  point_cloud<S, 3> pairs;
  pairs.points.resize(3, 800);
  for (index_t i = 0; i < 800; ++i) {
    const index_t k = i / 2 * 239 % 400;
    pairs.points.col(i) << S(3 * (k % 20)) + S(0.5) * S(i % 2), S(3 * (k / 20)), S(k % 7);
  }
  write_ply(pairs, folder / "pairs.ply");
  const auto check = [&](const auto& steps, const std::string& name) {
    const auto whole = pairs | steps;
    const auto expected = connected_components(whole, radius{1});
    CHECK(expected.size() > 100);
    for (const double edge : {4.0, 25.0}) {
      INFO(name, " ", edge);
      check_same((open_tiles<S>(folder / "pairs.ply", {.edge = edge}) | steps |
                  write_clusters(folder / (name + std::to_string(int(edge))), radius{1}))
                     .read(),
                 labelled(whole, expected));
    }
  };
  check(remove_radius_outliers({.radius = 1, .min_neighbors = 1}), "filtered");
  check(voxel_downsample(0.4), "voxels");
  check(voxel_downsample(0.4) | remove_statistical_outliers({.neighbors = 2}), "limited");
}
