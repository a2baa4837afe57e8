// SPDX-License-Identifier: MIT
//
// What all benchmark programs share: the data, and the counter by which their results are compared.
#pragma once

#include <benchmark/benchmark.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

/// Edge of the voxels, in metres; neighbours of a point.
inline constexpr float voxel_edge = 0.01f;
inline constexpr int neighbor_count = 10;
/// What statistical outlier removal is asked with.
inline constexpr int outlier_neighbors = 20;
inline constexpr double outlier_deviations = 2;
/// How one frame is aligned with another.
inline constexpr double align_max_distance = 0.05;
inline constexpr int align_iterations = 15;
/// The depth image of depth.u16.
inline constexpr int image_width = 640, image_height = 480;
inline constexpr float focal_length = 585;

inline std::string data_path(const char* name) {
  const char* folder = std::getenv("CILANTRO_BENCHMARK_DATA");
  return std::string{folder ? folder : "."} + "/" + name;
}

inline std::vector<float> read_floats(const char* name) {
  std::ifstream in{data_path(name), std::ios::binary};
  const std::vector<char> bytes{std::istreambuf_iterator<char>{in}, {}};
  if (bytes.empty()) {
    std::fprintf(stderr, "no data: run scripts/benchmark.sh\n");
    std::exit(1);
  }
  const auto* first = reinterpret_cast<const float*>(bytes.data());
  return std::vector<float>{first, first + bytes.size() / sizeof(float)};
}

/// The frame: x, y and z of one point after another.
inline const std::vector<float>& frame() {
  static const std::vector<float> points = read_floats("frame.f32");
  return points;
}

/// A depth image in millimetres, row by row.
inline const std::vector<std::uint16_t>& depth_image() {
  static const std::vector<std::uint16_t> pixels = [] {
    std::ifstream in{data_path("depth.u16"), std::ios::binary};
    std::vector<std::uint16_t> all(std::size_t{image_width} * image_height);
    in.read(reinterpret_cast<char*>(all.data()), std::streamsize(all.size() * 2));
    return all;
  }();
  return pixels;
}

/// A number that programs which did the same work agree on.
inline void report_result(benchmark::State& state, double result) {
  state.counters["result"] = result;
}

#define CILANTRO_BENCHMARK(function) \
  BENCHMARK(function)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime()
