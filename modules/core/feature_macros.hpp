// SPDX-License-Identifier: MIT
//
// What the standard library at hand has beyond C++20, for interfaces, which include no header of
// it.
#pragma once

#include <version>

#if defined(__cpp_lib_ranges) && __cpp_lib_ranges >= 202202L
#define CILANTRO_STANDARD_CLOSURES
#endif
