// SPDX-License-Identifier: MIT
//
// The points of one scan of an E57 file, as columns of numbers. A plain header, which needs nothing
// of any module.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "io/common/number.hpp"
#include "io/e57/e57_pages.hpp"
#include "io/e57/e57_xml.hpp"

namespace cilantro::e57 {

using detail::number;

/// How a value of each point is stored.
struct field {
  enum class form { integer, real, text };
  std::string name;
  form as = form::integer;
  unsigned bits = 0;                     ///< For each value.
  std::int64_t lowest = 0, highest = 0;  ///< Of integers.
  double scale = 1, offset = 0;
  bool is_scaled = false;

  /// The smallest type that holds all values.
  [[nodiscard]] number type() const;
};

/// Where the points of a scan are.
struct points_section {
  std::uint64_t at = 0;  ///< In the file.
  std::uint64_t count = 0;
  std::vector<field> fields;
};

/// What an element `points` says. Throws `detail::failure`.
points_section parse_points(const element& points, std::uint64_t file_size);

/// All values of all fields but texts, one column for each field. Calls `progress(done)` now and
/// then. `left` is how many bytes the packets of this and further scans can have, since none
/// belongs to two. Throws `detail::failure`.
std::vector<std::vector<double>> read_points(const pages& file, const points_section& section,
                                             std::uint64_t& left,
                                             const std::function<void(std::uint64_t)>& progress);

/// The number in an element, or in an attribute; 0 if there is no text. Throws `detail::failure`.
double real_in(std::string_view text);
std::int64_t integer_in(std::string_view text);

}  // namespace cilantro::e57
