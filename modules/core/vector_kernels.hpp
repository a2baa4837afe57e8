// SPDX-License-Identifier: MIT
//
// The seam between the library and the units that are compiled once for each vector instruction
// set. Internal. Why: docs/decisions/0017-vector-kernels.md
#pragma once

namespace cilantro::detail {

/// `vector_target` with its numbers, for units that know no modules.
enum class kernel_target {
  baseline,
  avx2,
  avx512,
  counting  ///< Of a test, which counts what is looked at.
};

/// What `make<V>()` gives for the target V of that number.
template <class Make>
auto for_target([[maybe_unused]] int number, Make make) {
#if defined(__x86_64__)
  if (number == static_cast<int>(kernel_target::avx512))
    return make.template operator()<kernel_target::avx512>();
  if (number == static_cast<int>(kernel_target::avx2))
    return make.template operator()<kernel_target::avx2>();
#endif
  return make.template operator()<kernel_target::baseline>();
}

}  // namespace cilantro::detail
