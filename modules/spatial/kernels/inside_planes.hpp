// SPDX-License-Identifier: MIT
//
// Which points are on the inner side of all planes, compiled for each vector target. Internal.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/vector_kernels.hpp"

namespace cilantro::detail {

/// Planes normal · p <= offset of `dimension` coordinates each, normals packed.
struct plane_list {
  const double* normals;
  const double* offsets;
  std::ptrdiff_t count;
  int dimension;
};

/// Writes to `out`, for each of `count` points that are `stride` scalars apart and to which `shift`
/// is added, 1 if it is inside all planes and finite, and otherwise 0. Sums are taken in the order
/// of the axes, so that the result is that of the plain formula.
template <class S>
using inside_planes = void(const S* points, std::ptrdiff_t stride, std::ptrdiff_t count,
                           const double* shift, const plane_list& planes, std::uint8_t* out);

/// What the units for each target instantiate.
template <kernel_target V, class S>
inside_planes<S>* inside_planes_in();

}  // namespace cilantro::detail
