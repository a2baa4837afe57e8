// SPDX-License-Identifier: MIT
//
// Which of a few centres is nearest to each of many points, compiled for each vector target.
// Internal.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/vector_kernels.hpp"

namespace cilantro::detail {

/// Beyond so many centres, a tree of them is faster than a look at all.
inline constexpr std::ptrdiff_t most_centers = 512;

/// Of the points with the given indices, which are `stride` scalars apart: the nearest centre, of
/// equally near ones the first, the squared distance to it and to the second nearest. Centres are
/// packed.
template <class S>
using nearest_centers = void(const S* points, std::ptrdiff_t stride, const std::int32_t* indices,
                             std::ptrdiff_t count, const S* centers, std::ptrdiff_t center_count,
                             std::int32_t* nearest, S* first, S* second);

#define CILANTRO_DECLARE(target)            \
  namespace target {                        \
  template <class S, int D>                 \
  nearest_centers<S>* nearest_centers_in(); \
  }
CILANTRO_FOR_VECTOR_TARGETS(CILANTRO_DECLARE)
#undef CILANTRO_DECLARE

}  // namespace cilantro::detail
