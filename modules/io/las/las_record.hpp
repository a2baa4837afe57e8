// SPDX-License-Identifier: MIT
//
// What the record of a point holds, for each of the eleven formats of LAS. A plain header, which
// needs nothing of any module.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "io/common/number.hpp"

namespace cilantro::las {

using detail::number;

inline constexpr int formats = 11;

/// Bytes of a record without extra bytes.
constexpr std::size_t record_size(int format) {
  constexpr std::array<std::size_t, formats> sizes{20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
  return sizes[static_cast<std::size_t>(format)];
}

/// Whether a format is one of those that came with LAS 1.4, whose first 30 bytes differ.
constexpr bool is_extended(int format) {
  return format >= 6;
}
constexpr bool has_time(int format) {
  return format != 0 && format != 2;
}
constexpr bool has_colors(int format) {
  return format == 2 || format == 3 || format == 5 || format == 7 || format == 8 || format == 10;
}
constexpr bool has_infrared(int format) {
  return format == 8 || format == 10;
}
constexpr bool has_waves(int format) {
  return format == 4 || format == 5 || format == 9 || format == 10;
}

/// Where red begins, followed by green and blue.
constexpr std::size_t colors_at(int format) {
  return is_extended(format) ? 30 : format == 2 ? 20 : 28;
}

/// A value of a record, which becomes an attribute.
struct field {
  enum class form {
    plain,
    bits,   ///< Some of the bits of a byte.
    rank,   ///< An angle in whole degrees, 8 bits.
    angle,  ///< An angle in steps of 0.006 degrees, 16 bits.
  };
  std::string_view name;
  number type = number::uint8;  ///< Of the attribute.
  std::size_t at = 0;           ///< The first byte in the record.
  form as = form::plain;
  unsigned shift = 0, bits = 0;
};

/// Degrees per step of `form::angle`.
inline constexpr double angle_step = 0.006;

/// All values but the coordinates and the colours.
inline std::vector<field> fields_of(int format) {
  using enum field::form;
  std::vector<field> fields{{"intensity", number::uint16, 12}};
  const auto add_bits = [&](std::string_view name, std::size_t at, unsigned shift, unsigned count) {
    fields.push_back({name, number::uint8, at, bits, shift, count});
  };
  const bool extended = is_extended(format);
  const std::size_t flags = extended ? 15 : 14;
  add_bits("return_number", 14, 0, extended ? 4 : 3);
  add_bits("number_of_returns", 14, extended ? 4 : 3, extended ? 4 : 3);
  add_bits("scan_direction", flags, 6, 1);
  add_bits("edge_of_flight_line", flags, 7, 1);
  if (extended)
    fields.push_back({"classification", number::uint8, 16});
  else
    add_bits("classification", 15, 0, 5);
  constexpr std::array marks{"synthetic", "key_point", "withheld", "overlap"};
  for (unsigned i = 0; i < (extended ? 4 : 3); ++i) add_bits(marks[i], 15, extended ? i : 5 + i, 1);
  if (extended) add_bits("scanner_channel", 15, 4, 2);
  fields.push_back(
      {"scan_angle", number::float32, extended ? std::size_t{18} : 16, extended ? angle : rank});
  fields.push_back({"user_data", number::uint8, 17});
  fields.push_back({"point_source_id", number::uint16, extended ? std::size_t{20} : 18});
  if (has_time(format))
    fields.push_back({"gps_time", number::float64, extended ? std::size_t{22} : 20});
  if (has_infrared(format)) fields.push_back({"near_infrared", number::uint16, 36});
  if (has_waves(format)) {
    const std::size_t at = record_size(format) - 29;
    fields.push_back({"wave_descriptor", number::uint8, at});
    fields.push_back({"wave_offset", number::uint64, at + 1});
    fields.push_back({"wave_size", number::uint32, at + 9});
    fields.push_back({"wave_location", number::float32, at + 13});
    fields.push_back({"wave_x", number::float32, at + 17});
    fields.push_back({"wave_y", number::float32, at + 21});
    fields.push_back({"wave_z", number::float32, at + 25});
  }
  return fields;
}

/// A value in the bytes after those of the format, as the record LASF_Spec 4 describes it.
struct extra_field {
  std::string name;  ///< As in the descriptor.
  number type = number::uint8;
  std::size_t count = 1;  ///< Of values; above 1 in old files only.
  bool is_scaled = false;
  std::array<double, 3> scale{1, 1, 1}, offset{};
  std::string descriptor = {};  ///< The 192 bytes.
};

inline constexpr std::size_t descriptor_size = 192;

}  // namespace cilantro::las
