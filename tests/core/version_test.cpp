// SPDX-License-Identifier: MIT
#include <string>

#include "spaces.hpp"

import cilantro;

using namespace cilantro;

static_assert(version_number{0, 2, 0} > version_number{0, 1, 9});
static_assert(version_number{1, 0, 0} > version_number{0, 9, 9});
static_assert(version >= version_number{0, 1, 0});

TEST_CASE("the version of the interfaces is that of the package") {
  const std::string said = std::to_string(version.major) + '.' + std::to_string(version.minor) +
                           '.' + std::to_string(version.patch);
  CHECK(said == CILANTRO_PACKAGE_VERSION);
}
