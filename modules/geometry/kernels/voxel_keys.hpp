// SPDX-License-Identifier: MIT
//
// Which cell of a grid points are in, compiled for each vector target. Internal.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/vector_kernels.hpp"

namespace cilantro::detail {

inline constexpr int most_key_axes = 3;

/// A grid of up to three axes, whose cells are within ±2³¹ and take 32 bits together.
struct key_layout {
  int axes;
  double origin[most_key_axes], edges[most_key_axes];
  std::int32_t low[most_key_axes];  ///< The first cell along each axis.
  int bits[most_key_axes];          ///< Of the cells from there on.
};

/// The keys of `count` of `points`, which are `stride` scalars apart; their order is that of the
/// cells, the first axis being the most significant.
template <class S>
using voxel_keys = void(const S* points, std::ptrdiff_t stride, const std::int32_t* indices,
                        std::ptrdiff_t count, const key_layout& layout, std::uint32_t* out);

/// The least and the largest coordinate of `count` packed points along each of up to three axes;
/// false, and nothing written, if one is not finite.
template <class S>
using finite_range = bool(const S* points, int axes, std::ptrdiff_t count, S* low, S* high);

/// What the units for each target instantiate.
template <kernel_target V, class S>
voxel_keys<S>* voxel_keys_in();
template <kernel_target V, class S>
finite_range<S>* finite_range_in();

}  // namespace cilantro::detail
