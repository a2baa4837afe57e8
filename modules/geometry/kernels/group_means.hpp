// SPDX-License-Identifier: MIT
//
// Means of groups of points, compiled for each vector target. Internal.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/vector_kernels.hpp"

namespace cilantro::detail {

/// Points, `stride` scalars apart, and some of their groups: the members of group g are the entries
/// `offsets[g]` to `offsets[g + 1]` of `members`.
template <class S>
struct grouped_points {
  const S* points;
  std::ptrdiff_t stride, count;
  const std::int32_t* members;
  const std::ptrdiff_t* offsets;
};

/// Writes the means of `count` groups from `first` on to `means`, packed: summed in double, in the
/// order of the members. Stops at the first that is not finite, and says how many it has written.
template <class S>
using group_means = std::ptrdiff_t(const grouped_points<S>& groups, std::ptrdiff_t first,
                                   std::ptrdiff_t count, S* means);

/// What the units for each target instantiate.
template <kernel_target V, class S, int D>
group_means<S>* group_means_in();

}  // namespace cilantro::detail
