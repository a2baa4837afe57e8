// SPDX-License-Identifier: MIT
//
// Which of many pairs can be right together, compiled for each vector target. Internal.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/vector_kernels.hpp"

namespace cilantro::detail {

/// Pairs by coordinate, padded to a multiple of 64 pairs with NaN; the normals of unknown ones are
/// NaN, too. In two dimensions, the third coordinates are zero.
struct pair_list {
  const float* source[3];
  const float* target[3];
  const float* source_normals[3];  ///< Null if there are none.
  const float* target_normals[3];
  float up[3];  ///< A direction that is kept; zeros if there is none.
};

struct pair_limits {
  float length;  ///< Lengths differ by at most this.
  float least;   ///< Shorter lengths say nothing.
  float cosine;  ///< Cosines differ by at most this.
  bool oriented;
};

struct pair_graph {
  /// Bit j of the row: whether pairs `i` and j can be right together.
  void (*row)(const pair_list& pairs, const pair_limits& limits, std::ptrdiff_t i,
              std::ptrdiff_t words, std::uint64_t* bits);
  /// The number of bits that two rows share.
  std::int64_t (*shared)(const std::uint64_t* a, const std::uint64_t* b, std::ptrdiff_t words);
};

/// What the units for each target instantiate.
template <kernel_target V>
const pair_graph& pair_graph_in();

}  // namespace cilantro::detail
