// SPDX-License-Identifier: MIT
//
// Colours in [0, 1] and from 0 to 255. A plain header, which needs nothing of any module.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace cilantro::detail {

inline constexpr auto eight_bit_colors = [] {
  std::array<float, 256> all{};
  for (int i = 0; i < 256; ++i) all[i] = float(i) / 255.0f;
  return all;
}();

inline float from_eight_bit(std::uint8_t color) {
  return eight_bit_colors[color];
}

inline std::uint8_t to_eight_bit(float color) {
  // NaN fails both comparisons and becomes black.
  return static_cast<std::uint8_t>(255.0f * (color > 0 ? std::min(color, 1.0f) : 0.0f) + 0.5f);
}

}  // namespace cilantro::detail
