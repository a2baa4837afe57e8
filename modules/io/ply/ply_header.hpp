// SPDX-License-Identifier: MIT
//
// The header of a PLY file as text and as data. A plain header that both halves of the
// implementation include; it needs nothing of any module.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/common/number.hpp"

namespace cilantro::ply {

enum class encoding { ascii, little_endian, big_endian };

using detail::number;
using detail::size_of;

/// The names of a number in a header, the one that is written first.
inline constexpr std::array<std::pair<std::string_view, number>, 16> number_names{{
    {"char", number::int8},
    {"uchar", number::uint8},
    {"short", number::int16},
    {"ushort", number::uint16},
    {"int", number::int32},
    {"uint", number::uint32},
    {"float", number::float32},
    {"double", number::float64},
    {"int8", number::int8},
    {"uint8", number::uint8},
    {"int16", number::int16},
    {"uint16", number::uint16},
    {"int32", number::int32},
    {"uint32", number::uint32},
    {"float32", number::float32},
    {"float64", number::float64},
}};

struct property {
  std::string name;
  number type = number::float32;  ///< Of the value, or of the items of a list.
  bool is_list = false;
  number count_type = number::uint8;  ///< Of the length of a list.
};

struct element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<property> properties;

  [[nodiscard]] bool has_lists() const {
    for (const auto& p : properties)
      if (p.is_list) return true;
    return false;
  }
  /// Bytes of one instance, counting only the length of a list.
  [[nodiscard]] std::size_t least_size() const {
    std::size_t size = 0;
    for (const auto& p : properties) size += size_of(p.is_list ? p.count_type : p.type);
    return size;
  }
};

struct header {
  encoding data = encoding::ascii;
  std::vector<element> elements;
  std::vector<std::string> comments;
};

}  // namespace cilantro::ply

namespace cilantro::detail {
class byte_stream;
}

namespace cilantro::ply {

/// Reads up to the end of the header. Throws `detail::failure`.
header read_header(detail::byte_stream& in);

}  // namespace cilantro::ply
