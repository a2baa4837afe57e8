// SPDX-License-Identifier: MIT
//
// Moving the points that several nodes move together, in three dimensions, compiled for each vector
// target. Internal.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/vector_kernels.hpp"

namespace cilantro::detail {

/// Numbers from one vector of three to the next.
inline constexpr std::ptrdiff_t place_stride = 4;

/// What one node does to a point p: `linear` · (p − `before`) + `after`, column by column. The
/// fourth number of each vector is 0.
struct node_frame {
  double before[place_stride], after[place_stride], linear[3 * place_stride];
};

/// Points that the same nodes move: those of the indices, `stride` scalars apart; and the weights
/// of each, `weight_stride` numbers after those of the one before it.
template <class S>
struct anchored_points {
  const S* points;
  std::ptrdiff_t stride;
  const std::int32_t* indices;
  const double* weights;
  std::ptrdiff_t weight_stride;
  std::ptrdiff_t count;
  const node_frame* frames;
  int anchors;
};

/// Writes for each index where the point goes to `places`, and, unless it is null, linear · (p −
/// before) for each of its nodes to `offsets`.
template <class S>
using move_by_anchors = void(const anchored_points<S>& all, double* places, double* offsets);

/// What the units for each target instantiate.
template <kernel_target V, class S>
move_by_anchors<S>* move_by_anchors_in();

}  // namespace cilantro::detail
