// SPDX-License-Identifier: MIT
//
// The Euclidean searches in two and three dimensions that are compiled once for each vector target:
// plain functions over plain arrays. Internal.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/vector_kernels.hpp"

namespace cilantro::detail {

/// A kd-tree in blocks of 16 points. Node 1 is the root, 2i and 2i + 1 are the children of node i,
/// and node 2^levels + k is the leaf that holds the blocks from (k · blocks) >> levels up to
/// ((k + 1) · blocks) >> levels.
///
/// A box is two times four numbers: the lower corner, padded to three coordinates, and the smallest
/// index inside, whose bits are those of an integer; then the upper corner, padded to four.
template <class S>
struct block_tree {
  std::ptrdiff_t blocks;
  int levels;
  const S* coordinates;         ///< Of a block: all x, all y, …; NaN where there is no point.
  const std::int32_t* indices;  ///< 16 a block; −1 where there is no point.
  const S* boxes;               ///< Of the blocks.
  const S* children;            ///< Of node i: both lower halves of its children's boxes, then both
                                ///< upper halves.
};

/// The blocks of a `kd_tree_nodes`.
template <class S, class Nodes>
block_tree<S> blocks_of(const Nodes& nodes) {
  return {nodes.blocks(),       nodes.levels,       nodes.coordinates.data(),
          nodes.indices.data(), nodes.boxes.data(), nodes.children.data()};
}

/// Where the neighbours of queries go: those of row r start at `r · k`, and `counts[r]` is their
/// number (unless null). The lists of `rows` say which row belongs to a query.
template <class S>
struct nearest_output {
  const std::int32_t* rows;
  std::int32_t* indices;
  S* distances;
  std::int32_t* counts;
};

/// The largest k that `nearest` takes.
inline constexpr int most_in_registers = 32;

template <class S>
struct block_search {
  /// The k nearest points, by ascending (sum, index), of every query in the blocks `begin` to `end`
  /// of `queries`, with no sum above `limit`. The rows are those of block `begin` and the
  /// following.
  void (*nearest)(const block_tree<S>& tree, const block_tree<S>& queries, std::ptrdiff_t begin,
                  std::ptrdiff_t end, int k, S limit, const nearest_output<S>& out);

  /// Which blocks have a point with a sum of at most `limit` to anything in block `b` of `queries`:
  /// writes them, and for each the bits of those queries that its box is near to; returns how many.
  std::ptrdiff_t (*blocks_within)(const block_tree<S>& tree, const block_tree<S>& queries,
                                  std::ptrdiff_t b, S limit, std::int32_t* blocks,
                                  std::uint16_t* masks);

  /// The points with a sum of at most `limit` to query `q` of block `b`, among those that
  /// `blocks_within` has listed; ascending, if so wanted. Returns how many; there must be room for
  /// all points of the listed blocks in the output and, twice, in `room`.
  std::ptrdiff_t (*within)(const block_tree<S>& tree, const block_tree<S>& queries,
                           std::ptrdiff_t b, int q, S limit, const std::int32_t* blocks,
                           const std::uint16_t* masks, std::ptrdiff_t count, bool ascending,
                           void* room, std::int32_t* indices, S* distances);
};

/// What searches have done. Counted only by a target for tests, where CILANTRO_COUNT_WORK is set;
/// it costs nothing elsewhere.
struct search_work {
  std::int64_t nodes;      ///< Whose children were looked at, by a block of queries.
  std::int64_t distances;  ///< From a query to a place of a block.
};
#ifdef CILANTRO_COUNT_WORK
extern search_work counted_work;
#define CILANTRO_COUNT(what, amount) counted_work.what += amount
#else
#define CILANTRO_COUNT(what, amount) static_cast<void>(0)
#endif

/// A candidate in `room`.
inline constexpr std::size_t candidate_size = 16;

/// What the units for each target instantiate.
template <kernel_target V, class S, int D>
const block_search<S>& block_search_in();

}  // namespace cilantro::detail
