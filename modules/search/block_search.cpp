// SPDX-License-Identifier: MIT
#include "search/block_search.hpp"

#include "search/candidates.hpp"
#include "search/found_points.hpp"

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

  query_block(const block_tree<S>& queries, std::ptrdiff_t b) {
    __builtin_memcpy(at, queries.coordinates + b * D * width, sizeof at);
    const S* box = queries.boxes + 8 * b;
    const vec<S, 4> l = load<vec<S, 4>>(box), h = load<vec<S, 4>>(box + 4);
    low_ = __builtin_shufflevector(l, l, 0, 1, 2, 3, 0, 1, 2, 3);
    high_ = __builtin_shufflevector(h, h, 0, 1, 2, 3, 0, 1, 2, 3);
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

/// The k nearest of each query of a block. A whole block walks the tree at once; each of its boxes
/// is compared with all queries, and only those that it may matter to look at its points.
template <class S, int D, int R>
class nearest_of_block {
 public:
  using all = vec<S, width>;
  using all_indices = vec<std::int32_t, width>;
  using list = sorted_list<S, R>;

  nearest_of_block(const block_tree<S>& tree, const block_tree<S>& queries, std::ptrdiff_t b,
                   const list& empty, S limit)
      : tree_{tree}, queries_{queries, b}, limit_{limit}, own_{&tree == &queries ? b : -1} {
    for (int q = 0; q < width; ++q) {
      const bool is_there = queries.indices[b * width + q] >= 0;
      lists_[q] = empty;
      worst_sum_[q] = is_there ? limit : S(-1);
      worst_index_[q] = no_index;
    }
    update();
  }

  void run() {
    // Points of the block itself are the nearest ones, as a rule.
    if (own_ >= 0) scan(own_);
    walk(tree_, queries_, *this);
  }

  [[nodiscard]] CILANTRO_ALWAYS_INLINE bool admits(S bound, const S* box) const {
    return bound < farthest_ || (bound == farthest_ && smallest_index(box) < last_index_);
  }
  CILANTRO_ALWAYS_INLINE void visit(std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t b = begin; b < end; ++b)
      if (b != own_) scan(b);
  }

  /// Row r of the output for query q; returns how many there are.
  CILANTRO_ALWAYS_INLINE int write(int q, int k, std::int32_t* indices, S* distances) const {
    S sum[list::capacity];
    std::int32_t index[list::capacity];
    lists_[q].write(sum, index);
    constexpr int c = list::capacity;
    for (int i = 0; i < c; ++i) sum[i] = square_root(sum[i]);
    const S* sums_from = sum + (c - k);
    const std::int32_t* indices_from = index + (c - k);
    int i = 0, count = 0;
    for (; i + 4 <= k; i += 4) {
      __builtin_memcpy(distances + i, sums_from + i, 4 * sizeof(S));
      __builtin_memcpy(indices + i, indices_from + i, 4 * sizeof(std::int32_t));
    }
    for (; i < k; ++i) {
      distances[i] = sums_from[i];
      indices[i] = indices_from[i];
    }
    for (i = 0; i < k; ++i) count += indices_from[i] != no_index;
    return count;
  }

 private:
  static CILANTRO_ALWAYS_INLINE float square_root(float x) { return __builtin_sqrtf(x); }
  static CILANTRO_ALWAYS_INLINE double square_root(double x) { return __builtin_sqrt(x); }

  void scan(std::ptrdiff_t b) {
    const S* box = tree_.boxes + 8 * b;
    const all bound = queries_.bounds_to(box);
    const all worst = load<all>(worst_sum_);
    unsigned near = bits(bound < worst);
    if (const unsigned ties = bits(bound == worst); ties != 0)
      near |= ties & bits(all_indices(smallest_index(box)) < load<all_indices>(worst_index_));
    if (near == 0) return;
    const S* block = tree_.coordinates + b * D * width;
    const auto indices = load<all_indices>(tree_.indices + b * width);
    for (; near != 0; near &= near - 1) {
      const int q = __builtin_ctz(near);
      const all sums = queries_.sums_to(block, q);
      unsigned which = bits(sums <= all(worst_sum_[q]));
      if (which == 0) continue;
      const candidates<S> found{sums, indices};
      list best = lists_[q];
      do {
        const int first = __builtin_ctz(which);
        which &= which - 1;
        const int second = __builtin_ctz(which | 1u << width);
        which &= which - 1;
        best.add(found[first], found[second]);
      } while (which != 0);
      lists_[q] = best;
      worst_sum_[q] = smaller(best.last_sum(), limit_);
      worst_index_[q] = best.last_index();
    }
    update();
  }
  CILANTRO_ALWAYS_INLINE void update() {
    farthest_ = largest_lane(load<all>(worst_sum_));
    last_index_ = largest_lane(load<all_indices>(worst_index_));
  }

  const block_tree<S>& tree_;
  const query_block<S, D> queries_;
  const S limit_;
  const std::ptrdiff_t own_;  ///< The block that the queries are the points of, or −1.
  list lists_[width];
  alignas(64) S worst_sum_[width];
  alignas(64) std::int32_t worst_index_[width];
  S farthest_ = 0;               ///< The largest of `worst_sum_`.
  std::int32_t last_index_ = 0;  ///< The largest of `worst_index_`.
};

template <class S, int D, int R>
void nearest_in(const block_tree<S>& tree, const block_tree<S>& queries, std::ptrdiff_t begin,
                std::ptrdiff_t end, int k, S limit, const nearest_output<S>& out) {
  const sorted_list<S, R> empty{k};
  for (std::ptrdiff_t b = begin; b < end; ++b) {
    nearest_of_block<S, D, R> search{tree, queries, b, empty, limit};
    search.run();
    const std::int32_t* rows = out.rows + (b - begin) * width;
    for (int q = 0; q < width && queries.indices[b * width + q] >= 0; ++q) {
      const std::ptrdiff_t at = std::ptrdiff_t{rows[q]} * k;
      const int count = search.write(q, k, out.indices + at, out.distances + at);
      if (out.counts) out.counts[rows[q]] = count;
    }
  }
}

template <class S, int D>
void nearest(const block_tree<S>& tree, const block_tree<S>& queries, std::ptrdiff_t begin,
             std::ptrdiff_t end, int k, S limit, const nearest_output<S>& out) {
  const auto run = [&]<int R>() { nearest_in<S, D, R>(tree, queries, begin, end, k, limit, out); };
  const int registers = (k + list_lanes - 1) / list_lanes;
  if (registers <= 1) return run.template operator()<1>();
  if (registers <= 2) return run.template operator()<2>();
  if (registers <= 3) return run.template operator()<3>();
  if (registers <= 4) return run.template operator()<4>();
  if constexpr (list_lanes == 4) {
    if (registers <= 6) return run.template operator()<6>();
    return run.template operator()<8>();
  }
}

template <class S, int D>
std::ptrdiff_t blocks_within(const block_tree<S>& tree, const block_tree<S>& queries,
                             std::ptrdiff_t b, S limit, std::int32_t* blocks,
                             std::uint16_t* masks) {
  using all = vec<S, width>;
  struct within_limit {
    const block_tree<S>& tree;
    const query_block<S, D> queries;
    const S limit;
    std::int32_t* const blocks;
    std::uint16_t* const masks;
    std::ptrdiff_t count;

    CILANTRO_ALWAYS_INLINE bool admits(S bound, const S*) const { return bound <= limit; }
    CILANTRO_ALWAYS_INLINE void visit(std::ptrdiff_t begin, std::ptrdiff_t end) {
      for (std::ptrdiff_t i = begin; i < end; ++i) {
        masks[count] =
            static_cast<std::uint16_t>(bits(queries.bounds_to(tree.boxes + 8 * i) <= all(limit)));
        blocks[count] = static_cast<std::int32_t>(i);
        count += masks[count] != 0;
      }
    }
  } reach{tree, query_block<S, D>{queries, b}, limit, blocks, masks, 0};
  walk(tree, reach.queries, reach);
  return reach.count;
}

template <class S, int D>
std::ptrdiff_t within(const block_tree<S>& tree, const block_tree<S>& queries, std::ptrdiff_t b,
                      int q, S limit, const std::int32_t* blocks, const std::uint16_t* masks,
                      std::ptrdiff_t count, bool ascending, void* room, std::int32_t* indices,
                      S* distances) {
  using all = vec<S, width>;
  all query[D];
  for (int d = 0; d < D; ++d) query[d] = queries.coordinates[(b * D + d) * width + q];
  found_points<S> found{room, count * width};
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    if ((masks[i] >> q & 1) == 0) continue;
    const S* block = tree.coordinates + std::ptrdiff_t{blocks[i]} * D * width;
    all difference[D];
    for (int d = 0; d < D; ++d) difference[d] = query[d] - load<all>(block + d * width);
    const all sums = sum_of_squares(difference);
    const unsigned which = bits(sums <= all(limit));
    if (which == 0) continue;
    const auto all_indices =
        load<vec<std::int32_t, width>>(tree.indices + std::ptrdiff_t{blocks[i]} * width);
    found.add(candidates<S>{sums, all_indices}, which);
  }
  (ascending ? sorted(found) : found).write(indices, distances);
  return found.size();
}

}  // namespace

template <class S, int D>
const block_search<S>& block_search_in() {
  static constexpr block_search<S> functions{nearest<S, D>, blocks_within<S, D>, within<S, D>};
  return functions;
}
template const block_search<float>& block_search_in<float, 2>();
template const block_search<float>& block_search_in<float, 3>();
template const block_search<double>& block_search_in<double, 2>();
template const block_search<double>& block_search_in<double, 3>();

}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET
