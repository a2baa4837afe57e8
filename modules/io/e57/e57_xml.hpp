// SPDX-License-Identifier: MIT
//
// As much of XML as E57 files use. A plain header, which needs nothing of any module.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cilantro::e57 {

/// An element, with all text that is directly in it.
struct element {
  std::string name, text = {};
  std::vector<std::pair<std::string, std::string>> attributes = {};
  std::vector<element> children = {};

  /// The first child of that name, or null.
  [[nodiscard]] const element* child(std::string_view wanted) const;
  /// The value of an attribute; empty if there is none.
  [[nodiscard]] std::string_view attribute(std::string_view wanted) const;
};

/// The root of a text that begins at byte `at` of a file. Declarations of types are refused. Throws
/// `detail::failure`.
element parse_xml(std::string_view text, std::uint64_t at);

}  // namespace cilantro::e57
