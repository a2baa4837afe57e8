// SPDX-License-Identifier: MIT
//
// The scalars and dimensions that the library is compiled for, in one place. A macro, since C++ has
// no other way to instantiate a template for each of a list.
#pragma once

/// `f(S, D)` for each of them.
#define CILANTRO_FOR_CLOSED_SPACES(f) \
  f(float, 2) f(float, 3) f(float, dynamic) f(double, 2) f(double, 3) f(double, dynamic)
