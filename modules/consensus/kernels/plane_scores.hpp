// SPDX-License-Identifier: MIT
//
// How many points are near each of a few lines or planes, compiled for each vector target.
// Internal.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/vector_kernels.hpp"

namespace cilantro::detail {

/// So many hyperplanes are looked at together, while the points are at hand.
inline constexpr int planes_at_a_time = 4;

/// Of `count` points, whose coordinates are in D rows `row_stride` scalars apart, those count for
/// which |offset + normal · x| is at most `limit`, and `active` is not 0 unless it is null: in
/// `counts`, one each, and in `values`, 1 − scale (offset + normal · x)². Sums are in sixteen
/// lanes, taken together in order. A hyperplane is its normal and its offset; there are
/// `planes_at_a_time`.
template <class S>
using plane_scores = void(const S* rows, std::ptrdiff_t row_stride, const std::uint8_t* active,
                          std::ptrdiff_t count, const S* planes, S limit, S scale, double* counts,
                          double* values);

/// What the units for each target instantiate.
template <kernel_target V, class S, int D>
plane_scores<S>* plane_scores_in();

}  // namespace cilantro::detail
