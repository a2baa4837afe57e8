// SPDX-License-Identifier: MIT
#include "search/kernels/block_search.hpp"

#include "search/kernels/block_walk.hpp"
#include "search/kernels/candidates.hpp"
#include "search/kernels/found_points.hpp"

namespace cilantro::detail::CILANTRO_VECTOR_TARGET {
namespace {

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
      CILANTRO_COUNT(distances, width);
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
    CILANTRO_COUNT(distances, width);
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
}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET

namespace cilantro::detail {

using namespace CILANTRO_VECTOR_TARGET;

template <kernel_target V, class S, int D>
const block_search<S>& block_search_in() {
  static constexpr block_search<S> functions{nearest<S, D>, blocks_within<S, D>, within<S, D>};
  return functions;
}
template const block_search<float>& block_search_in<this_target, float, 2>();
template const block_search<float>& block_search_in<this_target, float, 3>();
template const block_search<double>& block_search_in<this_target, double, 2>();
template const block_search<double>& block_search_in<this_target, double, 3>();

}  // namespace cilantro::detail
