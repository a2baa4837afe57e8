// SPDX-License-Identifier: MIT
export module cilantro.core:version;

import cilantro.standard;

namespace cilantro {

/// `major`.`minor`.`patch`. A change that breaks code raises `major`, or `minor` before 1.0.
export struct version_number {
  int major, minor, patch;
  friend constexpr bool operator==(const version_number&, const version_number&) = default;
  friend constexpr auto operator<=>(const version_number&, const version_number&) = default;
};

/// The version of these interfaces, the one that `find_package(cilantro 0.1)` compares with:
/// `static_assert(cilantro::version >= cilantro::version_number{0, 1, 0});`
export inline constexpr version_number version{0, 1, 0};

}  // namespace cilantro
