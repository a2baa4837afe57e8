// SPDX-License-Identifier: MIT
//
// The header of a PCD file as data. A plain header, which needs nothing of any module.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "io/common/byte_stream.hpp"
#include "io/common/number.hpp"

namespace cilantro::pcd {

using detail::number;

enum class encoding { ascii, binary, binary_compressed };

struct field {
  std::string name;
  number type = number::float32;
  std::uint32_t count = 1;  ///< Of values a point.
};

struct header {
  std::vector<field> fields;
  std::uint64_t width = 0, height = 1, points = 0;
  encoding data = encoding::ascii;
  std::vector<std::string> comments;

  /// Values a point.
  [[nodiscard]] std::uint64_t columns() const {
    std::uint64_t sum = 0;
    for (const field& f : fields) sum += f.count;
    return sum;
  }
  /// Bytes a point.
  [[nodiscard]] std::uint64_t record() const {
    std::uint64_t sum = 0;
    for (const field& f : fields) sum += f.count * detail::size_of(f.type);
    return sum;
  }
};

/// What begins the comment that stands for a viewpoint.
inline constexpr std::string_view viewpoint_keyword = "VIEWPOINT ";

/// Reads up to the line DATA. Throws `detail::failure`.
header read_header(detail::byte_stream& in);

}  // namespace cilantro::pcd
