// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <nanoflann.hpp>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/closed_spaces.hpp"
module cilantro.search;

namespace cilantro {
namespace {

using point_index = std::uint32_t;

/// What nanoflann asks of a point set and of a metric, in one.
template <Scalar S, int D, Metric M>
struct nanoflann_points {
  points_view<S, D> points;

  [[nodiscard]] std::size_t kdtree_get_point_count() const {
    return static_cast<std::size_t>(points.size());
  }
  [[nodiscard]] S kdtree_get_pt(std::size_t i, std::size_t d) const {
    return points.data()[static_cast<index_t>(i) * points.stride() + static_cast<index_t>(d)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

template <Scalar S, int D, Metric M>
struct nanoflann_metric {
  using ElementType = S;   // NOLINT: nanoflann's names
  using DistanceType = S;  // NOLINT

  nanoflann_metric(const nanoflann_points<S, D, M>& all) : points{all.points} {}  // NOLINT

  S evalMetric(const S* query, point_index i, std::size_t) const {  // NOLINT
    return metric_sum<M>(query, points.data() + index_t{i} * points.stride(),
                         D == dynamic ? points.dimension() : D);
  }
  template <class U, class V>
  [[nodiscard]] S accum_dist(U a, V b, std::size_t) const {
    return M::term(static_cast<S>(a - b));
  }

  points_view<S, D> points;
};

/// nanoflann sums the distance to a box along the way, in another order than the distance to a
/// point is summed; this much slack keeps it from dropping a box whose points tie with the worst so
/// far.
template <Scalar S>
inline constexpr S slack = 1 + 256 * std::numeric_limits<S>::epsilon();

/// A point that may be among the neighbours: first its sum, then its index, in one integer, whose
/// order is theirs, since the bits of floating numbers that are not negative are ordered like them.
template <Scalar S>
class candidate {
 public:
  candidate() = default;
  candidate(S sum, point_index index)
      : key_{key{std::bit_cast<sum_bits>(sum)} << index_bits | index} {}

  [[nodiscard]] S sum() const {
    return std::bit_cast<S>(static_cast<sum_bits>(key_ >> index_bits));
  }
  [[nodiscard]] point_index index() const { return static_cast<point_index>(key_); }
  friend auto operator<=>(candidate a, candidate b) = default;

 private:
  using sum_bits = std::conditional_t<sizeof(S) == 4, std::uint32_t, std::uint64_t>;
  using key = std::conditional_t<sizeof(S) == 4, std::uint64_t, unsigned __int128>;
  static constexpr int index_bits = 32;
  key key_;
};

/// How far nanoflann has to look: a little farther than `sum`, as it leaves out what is just there.
template <Scalar S>
S search_bound(S sum) {
  return sum * slack<S> + std::numeric_limits<S>::min();
}

/// The best k so far in a sorted array: the fastest way while k is small.
template <Scalar S>
class sorted_result {
 public:
  using DistanceType = S;         // NOLINT: nanoflann's names, here and below
  using IndexType = point_index;  // NOLINT

  sorted_result(std::span<candidate<S>> room, S limit)
      : best_{room.data()}, capacity_{room.size()}, limit_{limit}, bound_{search_bound(limit)} {}

  [[nodiscard]] std::size_t size() const { return count_; }
  [[nodiscard]] bool full() const { return count_ == capacity_; }
  [[nodiscard]] S worstDist() const { return bound_; }  // NOLINT
  bool addPoint(S sum, point_index index) {             // NOLINT
    const candidate<S> next{sum, index};
    if (full() ? !(next < best_[count_ - 1]) : !(sum <= limit_)) return true;
    std::size_t at = full() ? count_ - 1 : count_++;
    for (; at > 0 && next < best_[at - 1]; --at) best_[at] = best_[at - 1];
    best_[at] = next;
    if (full()) bound_ = search_bound(best_[count_ - 1].sum());
    return true;
  }
  void sort() {}

 private:
  candidate<S>* best_;
  std::size_t capacity_, count_ = 0;
  S limit_, bound_;
};

/// The best k so far in a heap, for large k, also for all within a radius.
template <Scalar S>
class heap_result {
 public:
  using DistanceType = S;         // NOLINT
  using IndexType = point_index;  // NOLINT

  heap_result(std::vector<candidate<S>>& heap, std::size_t capacity, S limit)
      : heap_{heap}, capacity_{capacity}, limit_{limit}, bound_{search_bound(limit)} {
    heap_.clear();
  }

  [[nodiscard]] std::size_t size() const { return heap_.size(); }
  [[nodiscard]] bool full() const { return heap_.size() == capacity_; }
  [[nodiscard]] S worstDist() const { return bound_; }  // NOLINT
  bool addPoint(S sum, point_index index) {             // NOLINT
    const candidate<S> next{sum, index};
    if (!full()) {
      if (!(sum <= limit_)) return true;
      heap_.push_back(next);
      if (!full()) return true;
      std::make_heap(heap_.begin(), heap_.end());
    } else if (next < heap_.front()) {
      std::pop_heap(heap_.begin(), heap_.end());
      heap_.back() = next;
      std::push_heap(heap_.begin(), heap_.end());
    }
    bound_ = search_bound(heap_.front().sum());
    return true;
  }
  /// Called by newer versions of nanoflann at the end of a search; older ones leave it to us.
  void sort() {}
  void finish() { std::sort(heap_.begin(), heap_.end()); }

 private:
  std::vector<candidate<S>>& heap_;
  std::size_t capacity_;
  S limit_, bound_;
};

/// Beyond this many neighbours, moving a sorted array costs more than a heap.
constexpr std::size_t most_sorted = 64;

/// What a thread needs from query to query.
template <Scalar S>
struct scratch {
  std::array<candidate<S>, most_sorted> sorted;
  std::vector<candidate<S>> heap;
};

}  // namespace

template <Scalar S, int D, Metric M>
struct kd_tree_engine<S, D, M>::state {
  using points_type = nanoflann_points<S, D, M>;
  using index_type =
      nanoflann::KDTreeSingleIndexAdaptor<nanoflann_metric<S, D, M>, points_type, D, point_index>;

  state(points_view<S, D> view, kd_tree_options options) : all{view} { build(options); }
  state(point_matrix<S, D>&& matrix, kd_tree_options options) : owned{std::move(matrix)} {
    all = as_points(owned);
    build(options);
  }

  void build(kd_tree_options options) {
    expects(all.empty() || all.dimension() > 0, "kd_tree: points must have at least one dimension");
    expects(all.size() <= std::numeric_limits<std::int32_t>::max(),
            "kd_tree: at most 2^31 - 1 points can be searched");
    expects(options.max_leaf_size > 0, "kd_tree: max_leaf_size must be at least 1");
    largest = largest_searchable_coordinate<S>(all.dimension());
    keep_searchable();
    if (!searched.points.empty())
      index.emplace(static_cast<int>(all.dimension()), searched,
                    nanoflann::KDTreeSingleIndexAdaptorParams(
                        static_cast<std::size_t>(options.max_leaf_size)));
  }

  /// nanoflann wants all points of its set searchable: otherwise those that are get copied.
  void keep_searchable() {
    const auto is_bad = [&](index_t i) {
      return !is_searchable(all.data() + i * all.stride(), all.dimension(), largest);
    };
    index_t bad = 0;
    for (index_t i = 0; i < all.size(); ++i) bad += is_bad(i);
    searched.points = all;
    if (bad == 0) return;
    copied.resize(all.dimension(), all.size() - bad);
    original.reserve(static_cast<std::size_t>(copied.cols()));
    for (index_t i = 0; i < all.size(); ++i) {
      if (is_bad(i)) continue;
      copied.col(std::ssize(original)) = all[i];
      original.push_back(static_cast<point_index>(i));
    }
    searched.points = as_points(copied);
  }

  /// Hands the neighbours in order to `write(candidate)` and returns how many there are.
  template <class F>
  std::size_t search(const S* query, const neighborhood_spec& spec, scratch<S>& room,
                     F&& write) const {
    if (!index || spec.max_count() == 0 || !is_searchable(query, all.dimension(), largest))
      return 0;
    const S limit = M::sum(static_cast<S>(spec.max_distance()));
    const auto capacity =
        static_cast<std::size_t>(std::min(spec.max_count(), searched.points.size()));
    // A radius without a count may find many: then the heap, never full, is a list to sort.
    if (spec.is_count_limited() && capacity <= most_sorted) {
      sorted_result<S> result{std::span{room.sorted}.first(capacity), limit};
      index->findNeighbors(result, query, {});
      for (std::size_t i = 0; i < result.size(); ++i) write(room.sorted[i]);
      return result.size();
    }
    heap_result<S> result{room.heap,
                          spec.is_count_limited() ? capacity : searched.points.size() + 1, limit};
    index->findNeighbors(result, query, {});
    result.finish();
    for (const auto& c : room.heap) write(c);
    return room.heap.size();
  }

  void find(const S* query, const neighborhood_spec& spec, scratch<S>& room,
            std::vector<neighbor<S>>& out) const {
    out.clear();
    search(query, spec, room, [&](const candidate<S>& c) {
      out.push_back({original_index(c.index()), M::distance(c.sum())});
    });
  }

  [[nodiscard]] point_index original_index(point_index i) const {
    return original.empty() ? i : original[i];
  }

  point_matrix<S, D> owned;  ///< If the tree took its points over.
  points_view<S, D> all;     ///< All points, as the user numbers them.
  point_matrix<S, D> copied;
  std::vector<point_index> original;  ///< The user's index of a copied point; empty if none is.
  points_type searched;
  S largest = 0;
  std::optional<index_type> index;  ///< Refers to `searched`; nothing if there is nothing to find.
};

template <Scalar S, int D, Metric M>
kd_tree_engine<S, D, M>::kd_tree_engine(points_view<S, D> points, kd_tree_options options)
    : state_{std::make_unique<const state>(points, options)} {}
template <Scalar S, int D, Metric M>
kd_tree_engine<S, D, M>::kd_tree_engine(point_matrix<S, D>&& points, kd_tree_options options)
    : state_{std::make_unique<const state>(std::move(points), options)} {}
template <Scalar S, int D, Metric M>
kd_tree_engine<S, D, M>::~kd_tree_engine() = default;

template <Scalar S, int D, Metric M>
points_view<S, D> kd_tree_engine<S, D, M>::points() const {
  return state_->all;
}

template <Scalar S, int D, Metric M>
void kd_tree_engine<S, D, M>::find(const S* query, const neighborhood_spec& spec,
                                   std::vector<neighbor<S>>& out) const {
  scratch<S> room;
  state_->find(query, spec, room, out);
}

template <Scalar S, int D, Metric M>
neighborhoods<S> kd_tree_engine<S, D, M>::find_all(points_view<S, D> queries,
                                                   const neighborhood_spec& spec,
                                                   const execution& how) const {
  const index_t n = queries.size();
  const index_t k = std::min(spec.max_count(), state_->searched.points.size());
  const auto query = [&](index_t q) { return queries.data() + q * queries.stride(); };
  if (!spec.is_count_limited() || std::isfinite(spec.max_distance()))
    return gather_neighborhoods<S>(n, how, [&] {
      return [&, room = scratch<S>{}](index_t q, std::vector<neighbor<S>>& out) mutable {
        state_->find(query(q), spec, room, out);
      };
    });

  // k nearest neighbours: almost every query has exactly k, so that each has its place at once.
  std::vector<index_t> offsets(static_cast<std::size_t>(n) + 1);
  buffer<std::int32_t> indices(static_cast<std::size_t>(n * k));
  buffer<S> distances(indices.size());
  parallel_blocks(n, query_block_size, how, [&](index_t, index_t begin, index_t end) {
    scratch<S> room;
    for (index_t q = begin; q < end; ++q) {
      auto at = static_cast<std::size_t>(q * k);
      const std::size_t found = state_->search(query(q), spec, room, [&](const candidate<S>& c) {
        indices[at] = static_cast<std::int32_t>(state_->original_index(c.index()));
        distances[at++] = M::distance(c.sum());
      });
      offsets[static_cast<std::size_t>(q) + 1] = static_cast<index_t>(found);
    }
  });

  // Queries that cannot be answered leave gaps of k; close them.
  index_t total = 0;
  for (index_t q = 0; q < n; ++q) {
    index_t& end = offsets[static_cast<std::size_t>(q) + 1];
    const index_t count = end;
    if (total != q * k) {
      std::copy_n(indices.begin() + q * k, count, indices.begin() + total);
      std::copy_n(distances.begin() + q * k, count, distances.begin() + total);
    }
    end = total += count;
  }
  indices.resize(static_cast<std::size_t>(total));
  distances.resize(static_cast<std::size_t>(total));
  return {std::move(offsets), std::move(indices), std::move(distances)};
}

#define CILANTRO_INSTANTIATE(S, D) template class kd_tree_engine<S, D, euclidean>;
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
