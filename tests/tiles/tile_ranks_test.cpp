// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

import cilantro;
import test_support;
import rank_support;
import tile_support;
using namespace cilantro;
using namespace std::chrono_literals;
namespace fs = std::filesystem;

namespace {

/// All files of a folder but for their names, as one text.
std::string content_of(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator{folder}) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::string all;
  for (const auto& path : files) {
    std::ifstream in{path, std::ios::binary};
    all += path.filename().string() + '\n' +
           std::string{std::istreambuf_iterator<char>{in}, std::istreambuf_iterator<char>{}};
  }
  return all;
}

}  // namespace

TEST_CASE("any number of ranks write the same files") {
  const test::temporary_folder folder;
  const auto ground = test::terrain<float>(12'000);
  fs::create_directory(folder / "in");
  for (int part = 0; part < 3; ++part)
    write_ply(ground | take(4000 * (part + 1)) | stride(part + 1),
              folder / ("in/" + std::to_string(part) + ".ply"));
  const auto steps = voxel_downsample(0.4) |
                     remove_statistical_outliers({.neighbors = 8, .deviations = 2}) |
                     estimate_normals(knn{8});
  const auto alone = open_tiles<float>(folder / "in", {.edge = 14}) | write_tiles(folder / "cut");
  (void)(alone | steps | write_tiles(folder / "alone"));
  const auto cut = content_of(folder / "cut"), expected = content_of(folder / "alone");
  for (const int count : {1, 2, 3, 4, 8}) {
    INFO(count);
    const auto cut_by_ranks = folder / ("cut" + std::to_string(count));
    const auto written = folder / ("out" + std::to_string(count));
    std::atomic<std::int64_t> visited = 0;
    test::in_process_ranks job{count};
    job.run([&](auto& world) {
      const auto tiles = open_tiles<float>(folder / "in", {.edge = 14, .threads = 1}).on(world) |
                         write_tiles(cut_by_ranks);
      const auto result = tiles | steps | write_tiles(written);
      for_each_tile(result, halo{0},
                    [&](const auto& tile) { visited += std::int64_t(tile.inside.size()); });
    });
    CHECK((content_of(cut_by_ranks) == cut));
    CHECK((content_of(written) == expected));
    CHECK(std::uint64_t(visited) == open_tiles<float>(folder / "alone").size());
  }
}

TEST_CASE("ranks that do different work are told so") {
  const test::temporary_folder folder;
  write_ply(test::terrain<float>(2000), folder / "a.ply");
  test::in_process_ranks job{2};
  CHECK_THROWS_WITH(job.run([&](auto& world) {
    const auto survey = open_tiles<float>(folder / "a.ply", {.edge = 20}).on(world);
    (void)(survey | voxel_downsample(world.rank() + 1.0) | write_tiles(folder / "out"));
  }),
                    doctest::Contains("ranks work on different files, or by different steps"));
}

TEST_CASE("what fails on one rank fails on all, and goes on from there") {
  const test::temporary_folder folder;
  write_ply(test::terrain<float>(6000), folder / "a.ply");
  const auto fail_if = [&](bool fails) {
    return with_reach(0, [fails](point_cloud<float, 3> cloud) {
      if (fails && !cloud.empty() && cloud.points(0, 0) > 40) throw std::runtime_error{"no"};
      return cloud;
    });
  };
  std::atomic<int> thrown = 0;
  test::in_process_ranks job{3};
  try {
    job.run([&](auto& world) {
      try {
        (void)(open_tiles<float>(folder / "a.ply", {.edge = 9, .threads = 1}).on(world) |
               fail_if(true) | write_tiles(folder / "out"));
      } catch (const std::exception& error) {
        ++thrown;
        CHECK(std::string{error.what()}.find("no") != std::string::npos);
      }
    });
  } catch (const std::exception&) {
  }
  CHECK(thrown == 3);
  CHECK(!fs::exists(folder / "out/tiles.index"));
  const auto survey = open_tiles<float>(folder / "a.ply", {.edge = 9});
  CHECK_THROWS_AS((void)(survey | fail_if(false) | write_tiles(folder / "out")), invalid_input);
  const auto result = survey | fail_if(false) | write_tiles(folder / "out", {.resume = true});
  test::check_same(result.read(), survey.read());
}

TEST_CASE("ranks stop after the tiles they are at when one of them is told to") {
  const test::temporary_folder folder;
  write_ply(test::terrain<float>(6000), folder / "a.ply");
  for (const bool parallel : {false, true})
    for (const bool at_once : {false, true}) {
      std::atomic<int> visited = 0, thrown = 0;
      std::atomic<bool> is_stopped = false;
      test::in_process_ranks job{3};
      job.run([&](auto& world) {
        const auto survey =
            open_tiles<float>(folder / "a.ply", {.edge = 5, .threads = 2}).on(world);
        REQUIRE(survey.tiles().size() > 200);
        std::stop_source stop;
        if (at_once && world.rank() == 1) stop.request_stop();
        try {
          for_each_tile(survey, halo{0},
                        [&](const auto&) {
                          ++visited;
                          if (world.rank() == 1) {
                            stop.request_stop();
                            is_stopped = true;
                          }
                          // The others are at work while one is told to stop.
                          while (!is_stopped && !at_once) std::this_thread::sleep_for(1ms);
                          std::this_thread::sleep_for(20ms);
                        },
                        {.parallel = parallel, .monitor = {.stop = stop.get_token()}});
        } catch (const std::exception&) {
          ++thrown;
        }
      });
      CHECK(thrown == 3);
      CHECK(visited < 40);
    }
}
