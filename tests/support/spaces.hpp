// SPDX-License-Identifier: MIT
//
// The lists of spaces for TEST_CASE_TEMPLATE; macros, since doctest wants them where types are
// listed.
#pragma once

#include <doctest/doctest.h>

#define ALL_SPACES test::f2, test::f3, test::f5, test::fx, test::d2, test::d3, test::d5, test::dx
#define CLOUD_SPACES test::f2, test::f3, test::d2, test::d3

/// Ends a test that needs data which is not there; ctest then reports it as skipped.
#define SKIP_WITHOUT(file)                          \
  if (!(file)) {                                    \
    MESSAGE("skipped: the test data is not there"); \
    return;                                         \
  }
