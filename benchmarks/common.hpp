// SPDX-License-Identifier: MIT
//
// What all benchmark programs share: the data, and the counter by which their results are compared.
#pragma once

#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

/// Edge of the voxels, in metres; neighbours of a point.
inline constexpr float voxel_edge = 0.01f;
inline constexpr int neighbor_count = 10;

inline std::string data_path(const char* name) {
  const char* folder = std::getenv("CILANTRO_BENCHMARK_DATA");
  return std::string{folder ? folder : "."} + "/" + name;
}

/// The frame: x, y and z of one point after another.
inline const std::vector<float>& frame() {
  static const std::vector<float> points = [] {
    std::ifstream in{data_path("frame.f32"), std::ios::binary};
    const std::vector<char> bytes{std::istreambuf_iterator<char>{in}, {}};
    if (bytes.empty()) {
      std::fprintf(stderr, "no data: run scripts/benchmark.sh\n");
      std::exit(1);
    }
    const auto* first = reinterpret_cast<const float*>(bytes.data());
    return std::vector<float>{first, first + bytes.size() / sizeof(float)};
  }();
  return points;
}

/// A number that programs which did the same work agree on.
inline void report_result(benchmark::State& state, double result) {
  state.counters["result"] = result;
}

#define CILANTRO_BENCHMARK(function) \
  BENCHMARK(function)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime()
