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
  // In the order of the tiles, by which equally large clusters are numbered.
  const auto points =
      (open_tiles<float>(folder / "ground.ply", {.edge = 11}) | steps | write_tiles(folder / "t"))
          .read();
  check_same(alone.read(), labelled(points, dbscan(points, how)));
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
