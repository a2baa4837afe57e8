// SPDX-License-Identifier: MIT
//
// The lists of spaces for TEST_CASE_TEMPLATE; macros, since doctest wants them where types are
// listed.
#pragma once

#include <doctest/doctest.h>

// Under the sanitizers each scalar, each kind of dimension and each compiled kernel's shape once:
// they look at memory and behaviour, which the other four spaces share, and units cost them three
// times as much.
#if __has_feature(address_sanitizer)
#define ALL_SPACES test::f3, test::d2, test::f5, test::dx
#else
#define ALL_SPACES test::f2, test::f3, test::f5, test::fx, test::d2, test::d3, test::d5, test::dx
#endif
#define CLOUD_SPACES test::f2, test::f3, test::d2, test::d3

/// Ends a test that needs data which is not there; ctest then reports it as skipped.
#define SKIP_WITHOUT(file)                          \
  if (!(file)) {                                    \
    MESSAGE("skipped: the test data is not there"); \
    return;                                         \
  }
