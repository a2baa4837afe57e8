// SPDX-License-Identifier: MIT
//
// The seam between the library and the units that are compiled once for each vector instruction
// set. Internal. Why: docs/decisions/0017-vector-kernels.md
#pragma once

/// `f(target)` for each that this architecture is compiled for, the one that every machine has
/// first.
#if defined(__x86_64__)
#define CILANTRO_FOR_VECTOR_TARGETS(f) f(baseline) f(avx2) f(avx512)
#else
#define CILANTRO_FOR_VECTOR_TARGETS(f) f(baseline)
#endif
