// SPDX-License-Identifier: MIT
//
// The nearest neighbours of moving queries, sixteen at a time, compiled for each vector target.
// Internal.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/vector_kernels.hpp"
#include "search/kernels/block_search.hpp"

namespace cilantro::detail {

/// What all blocks of a search have in common.
template <class S>
struct track_search {
  block_tree<S> tree;  ///< Of the points that are searched.
  const S* points;     ///< The same as the user has them, `stride` apart.
  std::ptrdiff_t stride;
  const S* linear;  ///< Queries q are moved to linear · (q − origin) + translation; by columns.
  const S* origin;
  const S* translation;
  S max_distance, reach;  ///< Beyond the first a neighbour is none; the second is where to look.
  S slack;                ///< The share by which the numbers of the test below may be off.
  bool is_known;          ///< Whether the blocks hold what an earlier search has found.
};

/// One block of queries: 16 of each.
template <class S>
struct track_block {
  const S* queries;       ///< All x, all y, …, not moved; NaN where there is none.
  unsigned wanted;        ///< Bits of the queries that are asked.
  S* places;              ///< Where each was, moved, when it was last searched for.
  std::int32_t* nearest;  ///< Its nearest point, or −1.
  S* others;              ///< Then, all but that were at least so far away; −1: unknown.
  S* distances;           ///< Written: to the nearest point.
};

template <class S>
using track_kernel = void(const track_search<S>& search, const track_block<S>& block);

/// What the units for each target instantiate.
template <kernel_target V, class S, int D>
track_kernel<S>* track_in();

}  // namespace cilantro::detail
