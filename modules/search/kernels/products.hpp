// SPDX-License-Identifier: MIT
//
// Products of queries and points in many dimensions, compiled for each vector target. Internal.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/vector_kernels.hpp"

namespace cilantro::detail {

/// How many points stand side by side, and for how many queries products are computed at a time.
inline constexpr int points_per_panel = 32, queries_per_tile = 4;

/// Points by panels: of each, the first coordinates, then the second ones, …; and their squared
/// lengths.
template <class S>
struct point_panels {
  const S* coordinates;
  const S* squares;
  std::ptrdiff_t dimension;
};

/// For queries and the panels from `begin` to `end`: ‖p‖² − 2 q·p, which orders points p by their
/// distance from q, for panel after panel and query after query; and as bits, which of these are at
/// most the query's limit.
template <class S>
using product_tiles = void(const point_panels<S>& panels, std::ptrdiff_t begin, std::ptrdiff_t end,
                           const S* const* queries, const S* limits, S* values,
                           std::uint32_t* masks);

/// What the units for each target instantiate.
template <kernel_target V, class S>
product_tiles<S>* product_tiles_in();

}  // namespace cilantro::detail
