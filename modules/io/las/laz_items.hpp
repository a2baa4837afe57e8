// SPDX-License-Identifier: MIT
//
// How the parts of a point of the formats 0 to 5 are coded, one after another. A plain header,
// which needs nothing of any module.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "io/common/random_bytes.hpp"
#include "io/las/laz_coder.hpp"
#include "io/las/laz_times.hpp"

namespace cilantro::laz {

using detail::load_little;
using detail::store_little;

inline std::uint8_t byte_at(const char* data, std::size_t i) {
  return static_cast<std::uint8_t>(data[i]);
}

/// A model for each of 256 values of a byte, made when it is needed.
class byte_models {
 public:
  symbol_model& of(std::uint8_t value) {
    auto& model = models_[value];
    if (model.empty()) model.begin(256);
    return model;
  }

 private:
  std::vector<symbol_model> models_ = std::vector<symbol_model>(256);
};

/// Coordinates, intensity and what else is in the first 20 bytes.
class point_item {
 public:
  static constexpr std::size_t size = 20;

  explicit point_item(const char* first) {
    std::memcpy(last_.data(), first, size);
    // Without the intensity, which is predicted from points of the same return only.
    last_[12] = last_[13] = 0;
    changes_.begin(64);
    for (auto& angle : angles_) angle.begin(256);
  }

  void next(decoder& in, char* out) {
    const unsigned changes = in.symbol(changes_);
    if (changes & 32) set(14, in.symbol(returns_.of(byte_at(last_.data(), 14))));
    const unsigned r = byte_at(last_.data(), 14) & 7u, n = (byte_at(last_.data(), 14) >> 3) & 7u;
    const unsigned kind = return_kinds[n][r], level = n > r ? n - r : r - n;
    if (changes != 0) next_values(in, changes, kind);
    next_place(in, kind, level, n == 1);
    std::memcpy(out, last_.data(), size);
  }

 private:
  /// Which points are alike, by the number of their return r among n, as [n][r].
  static constexpr std::uint8_t return_kinds[8][8] = {
      {15, 14, 13, 12, 11, 10, 9, 8},  {14, 0, 1, 3, 6, 10, 10, 9},
      {13, 1, 2, 4, 7, 11, 11, 10},    {12, 3, 4, 5, 8, 12, 12, 11},
      {11, 6, 7, 8, 9, 13, 13, 12},    {10, 10, 11, 12, 13, 14, 14, 13},
      {9, 10, 11, 12, 13, 14, 15, 14}, {8, 9, 10, 11, 12, 13, 14, 15}};

  void set(std::size_t at, unsigned value) { last_[at] = static_cast<char>(value); }

  void next_values(decoder& in, unsigned changes, unsigned kind) {
    auto& intensity = intensities_[kind];
    if (changes & 16)
      intensity = static_cast<std::uint16_t>(intensity_.decode(in, intensity, std::min(kind, 3u)));
    store_little(last_.data() + 12, intensity);
    if (changes & 8) set(15, in.symbol(classes_.of(byte_at(last_.data(), 15))));
    if (changes & 4) {
      const unsigned direction = (byte_at(last_.data(), 14) >> 6) & 1u;
      set(16, byte_at(last_.data(), 16) + in.symbol(angles_[direction]));
    }
    if (changes & 2) set(17, in.symbol(users_.of(byte_at(last_.data(), 17))));
    if (changes & 1)
      store_little(last_.data() + 18, static_cast<std::uint16_t>(source_.decode(
                                          in, load_little<std::uint16_t>(last_.data() + 18))));
  }

  void next_place(decoder& in, unsigned kind, unsigned level, bool is_single) {
    const unsigned single = is_single ? 1 : 0;
    const std::int32_t dx = x_.decode(in, dx_[kind].get(), single);
    move(0, dx);
    dx_[kind].add(dx);
    const std::int32_t dy =
        y_.decode(in, dy_[kind].get(), single + std::min(x_.length() & ~1u, 20u));
    move(4, dy);
    dy_[kind].add(dy);
    const unsigned mean = (x_.length() + y_.length()) / 2;
    heights_[level] = z_.decode(in, heights_[level], single + std::min(mean & ~1u, 18u));
    store_little(last_.data() + 8, heights_[level]);
  }

  void move(std::size_t at, std::int32_t by) {
    store_little(last_.data() + at,
                 load_little<std::uint32_t>(last_.data() + at) + static_cast<std::uint32_t>(by));
  }

  std::array<char, size> last_;
  std::array<std::uint16_t, 16> intensities_{};
  std::array<running_median, 16> dx_, dy_;
  std::array<std::int32_t, 8> heights_{};
  symbol_model changes_;
  std::array<symbol_model, 2> angles_;
  byte_models returns_, classes_, users_;
  integer_model intensity_{16, 4}, source_{16, 1}, x_{32, 2}, y_{32, 22}, z_{32, 20};
};

/// Red, green and blue, of 16 bits, byte by byte.
class color_item {
 public:
  static constexpr std::size_t size = 6;

  explicit color_item(const char* first) { set_last(first); }

  void set_last(const char* color) {
    for (std::size_t i = 0; i < size; ++i) last_[i] = byte_at(color, i);
  }
  [[nodiscard]] const std::array<std::uint8_t, size>& last() const { return last_; }

  void next(decoder& in, char* out) {
    last_ = next_after(in, last_);
    for (std::size_t i = 0; i < size; ++i) out[i] = static_cast<char>(last_[i]);
  }

  /// The colour that comes after another one.
  std::array<std::uint8_t, size> next_after(decoder& in,
                                            const std::array<std::uint8_t, size>& last) {
    if (changes_.empty()) {
      changes_.begin(128);
      for (auto& m : bytes_) m.begin(256);
    }
    const unsigned changes = in.symbol(changes_);
    auto now = last;
    const auto change = [&](std::size_t i, int expected) {
      if (changes & (1u << i))
        now[i] = static_cast<std::uint8_t>(in.symbol(bytes_[i]) +
                                           static_cast<unsigned>(std::clamp(expected, 0, 255)));
    };
    change(0, last[0]);
    change(1, last[1]);
    constexpr unsigned is_color = 64;
    if ((changes & is_color) == 0) {
      // Grey.
      for (std::size_t c = 2; c < size; ++c) now[c] = now[c - 2];
      return now;
    }
    // How red changed tells how green does, and both, how blue does.
    for (std::size_t b = 0; b < 2; ++b) {
      int by = now[b] - last[b];
      change(2 + b, by + last[2 + b]);
      by = (by + (now[2 + b] - last[2 + b])) / 2;
      change(4 + b, by + last[4 + b]);
    }
    return now;
  }

 private:
  std::array<std::uint8_t, size> last_{};
  symbol_model changes_;
  std::array<symbol_model, size> bytes_;
};

/// Bytes that nothing is known about.
class extra_item {
 public:
  extra_item(const char* first, std::size_t size) : last_(first, first + size), models_(size) {
    for (auto& m : models_) m.begin(256);
  }

  void next(decoder& in, char* out) {
    for (std::size_t i = 0; i < last_.size(); ++i)
      out[i] = last_[i] = static_cast<char>(
          static_cast<std::uint8_t>(byte_at(last_.data(), i) + in.symbol(models_[i])));
  }

 private:
  std::vector<char> last_;
  std::vector<symbol_model> models_;
};

}  // namespace cilantro::laz
