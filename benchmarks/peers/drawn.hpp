// SPDX-License-Identifier: MIT
//
// What programs that draw share: the colours of the points, and the picture that cilantro makes.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "common.hpp"

inline constexpr int background[3] = {24, 26, 32};

inline std::vector<std::uint8_t> read_bytes(const char* name) {
  std::ifstream in{data_path(name), std::ios::binary};
  return {std::istreambuf_iterator<char>{in}, {}};
}
inline const std::vector<std::uint8_t>& large_colors() {
  static const std::vector<std::uint8_t> colors = read_bytes("large_colors.u8");
  return colors;
}

/// How many pixels are not background; and how far the picture is from that of cilantro, in
/// decibels, if it is to be the same. A picture may be kept, to be looked at: in
/// CILANTRO_BENCHMARK_PICTURE.
inline void report_picture(benchmark::State& state, const std::vector<std::uint8_t>& pixels,
                           bool is_to_be_same) {
  int covered = 0;
  for (std::size_t i = 0; i < pixels.size(); i += 3)
    covered += pixels[i] != background[0] || pixels[i + 1] != background[1] ||
               pixels[i + 2] != background[2];
  report_result(state, covered);
  if (const auto wanted = read_bytes("picture.u8");
      is_to_be_same && wanted.size() == pixels.size()) {
    double sum = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const double off = double(pixels[i]) - double(wanted[i]);
      sum += off * off;
    }
    state.counters["psnr_db"] = 10 * std::log10(255 * 255 * double(pixels.size()) / sum);
  }
  if (const char* path = std::getenv("CILANTRO_BENCHMARK_PICTURE"))
    std::ofstream{path, std::ios::binary}.write(reinterpret_cast<const char*>(pixels.data()),
                                                std::streamsize(pixels.size()));
}

/// Gives Mesa's llvmpipe as many threads as the others have: with none of its own, it draws in the
/// one that calls.
inline void limit_drawing_threads() {
  const char* threads = std::getenv("OMP_NUM_THREADS");
  if (threads) setenv("LP_NUM_THREADS", std::string{threads} == "1" ? "0" : threads, 0);
}
