// SPDX-License-Identifier: MIT
//
// A survey that is larger than memory: made up, cut into tiles, and sent through steps.
//
//   survey_cilantro make FOLDER POINTS [SEED]   flight strips over hills, houses and trees, as LAS
//   survey_cilantro tile FILES OUT MEMORY_MB    cuts them into tiles
//   survey_cilantro run TILES OUT MEMORY_MB     voxels, outliers and normals, tile by tile
//   survey_cilantro whole FILES [OUT.ply]       the same steps of all points at once, in memory;
//                                               with a file, the time is also that of reading and
//                                               writing, as that of `run` is
//   survey_cilantro hash OUT                    the hash of what `run` wrote, to compare with that
//                                               of `whole`
//   survey_cilantro sums TILES OTHERS MEMORY_MB    what all points decide; OTHERS of another seed
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

import cilantro;
using namespace cilantro;
namespace fs = std::filesystem;

namespace {

/// A number from 0 to 1 that only a place and a purpose decide.
double noise(std::int64_t x, std::int64_t y, std::uint64_t purpose) {
  std::uint64_t h = static_cast<std::uint64_t>(x) * 0x9e3779b97f4a7c15u ^
                    static_cast<std::uint64_t>(y) * 0xc2b2ae3d27d4eb4fu ^
                    purpose * 0x165667b19e3779f9u;
  h ^= h >> 32;
  h *= 0xd6e8feb86659fd93u;
  h ^= h >> 32;
  h *= 0xd6e8feb86659fd93u;
  return double((h ^ h >> 32) >> 11) * 0x1p-53;
}

/// What a laser from above meets at a place: ground, a roof, or the crown of a tree.
double height_at(double x, double y, double chance) {
  const double ground = 30 * std::sin(x / 700) * std::cos(y / 900) + 4 * std::sin(x / 61 + y / 83);
  const auto plot_x = static_cast<std::int64_t>(std::floor(x / 40)),
             plot_y = static_cast<std::int64_t>(std::floor(y / 40));
  const double of_plot = noise(plot_x, plot_y, 1), in_x = x - 40 * double(plot_x) - 20,
               in_y = y - 40 * double(plot_y) - 20;
  if (of_plot < 0.2 && std::abs(in_x) < 8 && std::abs(in_y) < 6)
    return ground + 6 + 4 * of_plot - 0.5 * std::abs(in_y);
  const double from_trunk = std::hypot(in_x, in_y);
  if (of_plot > 0.5 && from_trunk < 6 && chance < 0.8)
    return ground + 12 * of_plot * (1 - from_trunk * from_trunk / 72) * (0.4 + 0.75 * chance);
  return ground;
}

constexpr index_t points_of_a_strip = 4'000'000;

/// Strips of 100 m, half of each covered by the next, 8 points a square metre in each.
void make(const fs::path& folder, std::int64_t points, std::uint64_t seed) {
  fs::create_directories(folder);
  constexpr double spacing = 0.35, width = 100;
  const std::int64_t strips = (points + points_of_a_strip - 1) / points_of_a_strip;
  const auto across = static_cast<index_t>(width / spacing);
  for (std::int64_t s = 0; s < strips; ++s) {
    const index_t n = std::min<std::int64_t>(points_of_a_strip, points - s * points_of_a_strip);
    point_cloud<double, 3> strip;
    strip.points.resize(3, n);
    strip.origin = Eigen::Vector3d{450'000, 5'400'000, 0};
    std::vector<std::uint16_t> intensity(n);
    parallel_for(n, {}, [&](index_t i) {
      const index_t line = i / across, in_line = i % across;
      const auto random = [&](std::uint64_t what) {
        return noise(s * points_of_a_strip + i, std::int64_t(seed), what);
      };
      // Lines go to and fro, and neither they nor the points in them are quite even.
      const double along = (double(line) + 0.8 * random(2)) * spacing,
                   side =
                       (double(line % 2 == 0 ? in_line : across - 1 - in_line) + 0.8 * random(3)) *
                       spacing;
      const double x = along, y = double(s) * width / 2 + side;
      double z = height_at(x, y, random(4)) + 0.03 * (random(5) - 0.5);
      if (random(6) < 2e-5) z += 80 * random(7);  // Birds.
      strip.points.col(i) << x, y, z;
      intensity[i] = static_cast<std::uint16_t>(65535 * random(8));
    });
    strip.set_attribute("intensity", attribute_values{std::move(intensity)});
    write_las(strip, folder / ("strip_" + std::to_string(1000 + s) + ".las"),
              {.scale = Eigen::Vector3d::Constant(0.001)});
  }
}

auto steps() {
  return voxel_downsample(0.4) | remove_statistical_outliers({.neighbors = 10, .deviations = 3}) |
         estimate_normals(knn{10});
}

struct measured {
  std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();

  static long of_file(const char* path, std::string_view key) {
    std::ifstream in{path};
    std::string word;
    long value = 0;
    while (in >> word)
      if (word == key) in >> value;
    return value;
  }
  void report(const char* what, std::uint64_t points) const {
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    std::printf(
        "%s: %.1f s, %.2f million points a second, %ld MB at most, read %.2f GB, wrote %.2f GB\n",
        what, seconds, double(points) / seconds / 1e6,
        of_file("/proc/self/status", "VmHWM:") / 1000,
        double(of_file("/proc/self/io", "rchar:")) / 1e9,
        double(of_file("/proc/self/io", "wchar:")) / 1e9);
  }
};

/// The same for the same points in any order.
std::uint64_t hash_of(const point_cloud<float, 3>& cloud) {
  std::uint64_t all = 0;
  for (index_t i = 0; i < cloud.size(); ++i) {
    std::uint64_t h = 14695981039346656037u;
    // Places as a file has them.
    const Eigen::Vector3d place = cloud.points.col(i).cast<double>() + cloud.full_origin(),
                          normal = cloud.normals.col(i).cast<double>();
    for (const auto* v : {&place, &normal})
      for (index_t d = 0; d < 3; ++d) {
        std::uint64_t bits;
        const double value = (*v)[d];
        std::memcpy(&bits, &value, 8);
        h = (h ^ bits) * 1099511628211u;
      }
    all += h ^ h >> 29;
  }
  return all;
}

std::uint64_t memory_of(const char* megabytes) {
  return std::strtoull(megabytes, nullptr, 10) * 1'000'000;
}

/// What all points of a survey decide together, and those of another one of the same place.
void sum_up(const char* files, const char* others, std::uint64_t memory) {
  const auto survey = open_tiles<float>(files, {.memory = memory});
  const auto other = open_tiles<float>(others, {.memory = memory});
  const auto points = survey.size();
  const auto timed = [&](const char* what, auto f) {
    const measured part;
    const auto result = f();
    part.report(what, points);
    return result;
  };
  const auto of_all = timed("moments", [&] { return mean_and_covariance(survey); });
  const auto values = timed("statistics", [&] { return statistics_of(survey, "intensity"); });
  const auto change =
      timed("compared", [&] { return compare(survey, other, {.max_distance = 1}); });
  const auto centers =
      timed("k-means, 8 centres", [&] { return kmeans(survey, 8, {.max_iterations = 10}); });
  const auto plane =
      timed("plane", [&] { return ransac_hyperplane(survey, {.max_residual = 0.5}); });
  const box part{
      .lower = (of_all->mean.cast<double>() + survey.origin() - Eigen::Vector3d::Constant(150))
                   .head<2>()
                   .eval(),
      .upper = (of_all->mean.cast<double>() + survey.origin() + Eigen::Vector3d::Constant(150))
                   .head<2>()
                   .eval()};
  auto scan = other.read_box(part);
  scan.points.colwise() += Eigen::Vector3f{0.2f, -0.1f, 0.1f};
  const auto found = timed("aligned", [&] { return align(scan, survey, {.max_distance = 1}); });
  std::printf(
      "mean z %g, intensity %g, %g of the points within 1 m, %d moves of centres, "
      "%td on a plane, a scan of %td points in %d iterations\n",
      double(of_all->mean.z()), values->mean, change.overlap, centers.iterations,
      plane ? plane->inliers : 0, scan.size(), found.iterations);
}

int run(int argc, char** argv) {
  const std::string_view what = argc > 1 ? argv[1] : "";
  const measured all;
  if (what == "make" && argc >= 4) {
    make(argv[2], std::atoll(argv[3]), argc > 4 ? std::strtoull(argv[4], nullptr, 10) : 0);
  } else if (what == "tile" && argc == 5) {
    const auto survey = open_tiles<float>(argv[2], {.memory = memory_of(argv[4])});
    all.report("opened", survey.size());
    const auto tiles = survey | write_tiles(argv[3]);
    all.report("opened and cut", tiles.size());
    std::printf("%td tiles of %g m\n", std::ssize(tiles.tiles()), tiles.edge());
  } else if (what == "run" && argc == 5) {
    const auto survey = open_tiles<float>(argv[2], {.memory = memory_of(argv[4])});
    const auto result = survey | steps() | write_tiles(argv[3]);
    all.report("processed", survey.size());
    std::printf("%llu points are left\n", static_cast<unsigned long long>(result.size()));
  } else if (what == "whole" && (argc == 3 || argc == 4)) {
    const auto cloud = open_tiles<float>(argv[2]).read();
    const measured steps_alone;
    const auto result = cloud | steps();
    steps_alone.report("processed in memory", std::uint64_t(cloud.size()));
    if (argc == 4) {
      write_ply(result, argv[3]);
      all.report("read, processed in memory and written", std::uint64_t(cloud.size()));
    }
    std::printf("%td points are left, hash %016llx\n", result.size(),
                static_cast<unsigned long long>(hash_of(result)));
  } else if (what == "hash" && argc == 3) {
    const auto tiled = open_tiles<float>(argv[2]).read();
    std::printf("%td points from tiles, hash %016llx\n", tiled.size(),
                static_cast<unsigned long long>(hash_of(tiled)));
  } else if (what == "sums" && argc == 5) {
    sum_up(argv[2], argv[3], memory_of(argv[4]));
  } else {
    std::cerr << "usage: the head of benchmarks/survey.cpp\n";
    return 2;
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
