// SPDX-License-Identifier: MIT
//
// Which of a few centres is nearest to each of many points, compiled for each vector target.
// Internal.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/vector_kernels.hpp"

namespace cilantro::detail {

/// With more centres than this, a tree of them is faster than comparing with all.
inline constexpr std::ptrdiff_t most_centers = 512;

/// Coordinates of centres in rows, padded to whole vectors with infinity.
template <class S>
struct center_rows {
  const S* rows;
  std::ptrdiff_t row_stride;
  std::ptrdiff_t count;
};
/// Rows are padded to a multiple of this.
inline constexpr std::ptrdiff_t center_row_unit = 16;

/// Of the points with the given indices, which are `stride` scalars apart: the nearest centre, of
/// equally near ones the first, the distance to it and to the second nearest.
template <class S>
using nearest_centers = void(const S* points, std::ptrdiff_t stride, const std::int32_t* indices,
                             std::ptrdiff_t count, const center_rows<S>& centers,
                             std::int32_t* nearest, S* first, S* second);

/// Centres after a step, and what is known about them.
template <class S>
struct moved_centers {
  const S* moves;   ///< How far each has moved.
  const S* halves;  ///< Half the way from each to the one nearest to it.
  S farthest;       ///< The largest move.
  S slack;          ///< What roundings allow, relative to a bound.
};

/// Of points as above, each with its centre, a bound on the distance to it from above and one on
/// the distance to any other from below: brings the bounds up to date, and writes to `doubtful` the
/// places in the list of those whose centre may be another now. How many they are.
template <class S>
using doubtful_points = std::ptrdiff_t(const S* points, std::ptrdiff_t stride,
                                       const std::int32_t* indices, std::ptrdiff_t count,
                                       const center_rows<S>& centers, const moved_centers<S>& known,
                                       const std::int32_t* own, S* upper, S* lower,
                                       std::int32_t* doubtful);

/// What the units for each target instantiate.
template <kernel_target V, class S, int D>
nearest_centers<S>* nearest_centers_in();
template <kernel_target V, class S, int D>
doubtful_points<S>* doubtful_points_in();

}  // namespace cilantro::detail
