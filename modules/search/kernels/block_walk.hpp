// SPDX-License-Identifier: MIT
//
// How a block of queries walks a tree. Internal; see core/vectors.hpp.
#pragma once

#include "core/vectors.hpp"
#include "search/kernels/block_search.hpp"

namespace cilantro::detail::CILANTRO_VECTOR_TARGET {
namespace {

/// Sums and bounds are added up in the order of the axes, without fused operations: as everywhere
/// in the library, so that all agree to the bit. Since rounding is monotone, the bound of a box
/// never exceeds the sum of a point inside, and needs no slack.
template <int D, class V>
CILANTRO_ALWAYS_INLINE V sum_of_squares(const V (&difference)[D]) {
  V sum = difference[0] * difference[0];
  for (int d = 1; d < D; ++d) sum += difference[d] * difference[d];
  return sum;
}

/// How far `values` are outside of [low, high].
template <class V, class S>
CILANTRO_ALWAYS_INLINE V outside(V values, S low, S high) {
  return larger(larger(V(low) - values, values - V(high)), V(0));
}

template <class S>
std::int32_t smallest_index(const S* box) {
  std::int32_t index;
  __builtin_memcpy(&index, box + 3, sizeof index);
  return index;
}

/// A block of queries and the box around them.
template <class S, int D>
class query_block {
 public:
  using all = vec<S, width>;
  using box_pair = vec<S, 8>;

  query_block(const block_tree<S>& queries, std::ptrdiff_t b)
      : query_block{queries.coordinates + b * D * width, load<vec<S, 4>>(queries.boxes + 8 * b),
                    load<vec<S, 4>>(queries.boxes + 8 * b + 4)} {}
  /// All x, all y, … of the queries, and the corners of the box around those that matter.
  query_block(const S* places, vec<S, 4> low, vec<S, 4> high)
      : low_{__builtin_shufflevector(low, low, 0, 1, 2, 3, 0, 1, 2, 3)},
        high_{__builtin_shufflevector(high, high, 0, 1, 2, 3, 0, 1, 2, 3)} {
    __builtin_memcpy(at, places, sizeof at);
  }

  /// The bounds of all queries to one box.
  [[nodiscard]] CILANTRO_ALWAYS_INLINE all bounds_to(const S* box) const {
    all difference[D];
    for (int d = 0; d < D; ++d) difference[d] = outside(load<all>(at[d]), box[d], box[4 + d]);
    return sum_of_squares(difference);
  }
  /// The sums of all points of a block to query `q`.
  [[nodiscard]] CILANTRO_ALWAYS_INLINE all sums_to(const S* block, int q) const {
    all difference[D];
    for (int d = 0; d < D; ++d) difference[d] = all(at[d][q]) - load<all>(block + d * width);
    return sum_of_squares(difference);
  }

  struct child_bounds {
    S first, second;
    bool second_is_nearer;
  };
  /// From the box of the queries to the boxes of two children; of equally near ones, the one whose
  /// centre is.
  [[nodiscard]] CILANTRO_ALWAYS_INLINE child_bounds bounds_to_children(const S* children) const {
    const auto low = load<box_pair>(children), high = load<box_pair>(children + 8);
    box_pair gap = larger(larger(low - high_, low_ - high), box_pair(0));
    gap *= gap;
    S first = gap[0], second = gap[4];
    for (int d = 1; d < D; ++d) {
      first += gap[d];
      second += gap[4 + d];
    }
    if (first != second) return {first, second, second < first};
    box_pair apart = (low + high) - (low_ + high_);
    apart = apart < 0 ? -apart : apart;
    S from_first = apart[0], from_second = apart[4];
    for (int d = 1; d < D; ++d) {
      from_first += apart[d];
      from_second += apart[4 + d];
    }
    return {first, second, from_second < from_first};
  }

  alignas(64) S at[D][width];

 private:
  box_pair low_, high_;
};

/// Visits the leaves that may matter, near ones first. `reach` knows how far that is:
/// `admits(bound, smallest index)`, and `visit(first block, last block)` may make it less.
template <class S, int D, class Reach>
CILANTRO_ALWAYS_INLINE void walk(const block_tree<S>& tree, const query_block<S, D>& queries,
                                 Reach& reach) {
  struct waiting {
    S bound;
    std::int32_t node;
  } stack[64];
  int top = 0;
  const std::int32_t first_leaf = std::int32_t{1} << tree.levels;
  std::int32_t node = 1;
  const auto may_matter = [&](S bound, std::int32_t n) {
    // The lower half of node n's own box, beside that of its sibling.
    return reach.admits(bound, tree.children + std::ptrdiff_t{16} * (n / 2) + 4 * (n % 2));
  };
  for (;;) {
    bool is_leaf = true;
    while (node < first_leaf) {
      CILANTRO_COUNT(nodes, 1);
      const auto [first, second, swap] =
          queries.bounds_to_children(tree.children + std::ptrdiff_t{16} * node);
      const S near = swap ? second : first, far = swap ? first : second;
      node = 2 * node + swap;
      if (may_matter(far, node ^ 1)) stack[top++] = {far, node ^ 1};
      if (may_matter(near, node)) continue;
      is_leaf = false;
      break;
    }
    if (is_leaf) {
      const std::ptrdiff_t k = node - first_leaf;
      reach.visit((k * tree.blocks) >> tree.levels, ((k + 1) * tree.blocks) >> tree.levels);
    }
    do {
      if (top == 0) return;
      --top;
    } while (!may_matter(stack[top].bound, stack[top].node));
    node = stack[top].node;
  }
}

}  // namespace
}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET
