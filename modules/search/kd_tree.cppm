// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
export module cilantro.search:kd_tree;

import cilantro.standard;
import cilantro.core;
import :kd_tree_nodes;
import :metric;
import :nearest;
import :neighbor_searcher;
import :neighborhood;
import :visit;

namespace cilantro {

// Searches for a block of queries at a time, by the kernels of block_search.hpp. Compiled in the
// library.

/// Whether these kernels can answer such queries, in two or three dimensions and by Euclidean
/// distance.
bool is_for_blocks(const neighborhood_spec& spec, index_t points);
template <Scalar S, int D>
void find_in_blocks(const kd_tree_nodes<S, D>& nodes, const S* query, index_t k, S limit,
                    std::vector<neighbor<S>>& out);
template <Scalar S, int D>
neighborhoods<S> find_all_in_blocks(const kd_tree_nodes<S, D>& nodes, points_view<S, D> queries,
                                    const neighborhood_spec& spec, const execution& how);
template <Scalar S, int D>
void visit_in_blocks(const kd_tree_nodes<S, D>& nodes, points_view<S, D> queries,
                     const neighborhood_spec& spec, const neighborhood_visitor<S>& visit,
                     const visit_options& options);

/// Searches with one metric. Compiled in the library for its own metrics, each scalar, and 2, 3 and
/// run-time dimensions.
template <Scalar S, int D, CoordinateMetric<S> M>
class kd_tree_engine {
 public:
  kd_tree_engine(points_view<S, D> points, const M& metric, const kd_tree_options& options)
      : nodes{points, options}, metric_{metric} {
    if (!points.empty()) expect_dimension<M>(points.dimension());
  }

  void find(const S* query, const neighborhood_spec& spec, std::vector<neighbor<S>>& out) const {
    search_scratch<S> room;
    find(query, spec, room, out);
  }
  void nearest_two(const S* query, S max_distance, std::array<neighbor<S>, 2>& out) const {
    if (nodes.searchable == 0 || !is_searchable(query, nodes.dimension, nodes.largest)) return;
    two_nearest_result<S> result{largest_sum_within(metric_, max_distance)};
    kd_tree_search<S, D, M, two_nearest_result<S>>{nodes, metric_, query, result}.run();
    auto* next = out.data();
    result.write([&](std::int32_t i, S sum) { *next++ = {i, metric_.distance(sum)}; });
  }
  [[nodiscard]] neighborhoods<S> find_all(points_view<S, D> queries, const neighborhood_spec& spec,
                                          const execution& how) const;
  void visit_all(points_view<S, D> queries, const neighborhood_spec& spec,
                 const neighborhood_visitor<S>& visit, const visit_options& options) const;

  const kd_tree_nodes<S, D> nodes;

 private:
  static constexpr bool has_blocks = std::same_as<M, euclidean> && kd_tree_nodes<S, D>::has_boxes;

  /// Makes functions `find(q, out)`, each with a scratch of its own.
  [[nodiscard]] auto finder(points_view<S, D> queries, const neighborhood_spec& spec) const {
    return [=, this] {
      return
          [=, this, room = search_scratch<S>{}](index_t q, std::vector<neighbor<S>>& out) mutable {
            find(queries.data() + q * queries.stride(), spec, room, out);
          };
    };
  }

  /// Passes the neighbours in order to `write(index, distance)` and returns their number.
  template <class F>
  index_t search(const S* query, const neighborhood_spec& spec, search_scratch<S>& room,
                 F&& write) const {
    if (nodes.searchable == 0 || spec.max_count() == 0 ||
        !is_searchable(query, nodes.dimension, nodes.largest))
      return 0;
    const S limit = largest_sum_within(metric_, static_cast<S>(spec.max_distance()));
    const auto capacity = static_cast<std::size_t>(std::min(spec.max_count(), nodes.searchable));
    const auto write_all = [&](std::span<const candidate<S>> found) {
      for (const auto& c : found) write(c.index(), metric_.distance(c.sum()));
      return std::ssize(found);
    };
    // A radius without a count may find many: the heap is then never full, and just a list to sort.
    if (spec.is_count_limited() && capacity <= most_sorted) {
      sorted_result<S> result{std::span{room.sorted}.first(capacity), limit};
      kd_tree_search<S, D, M, sorted_result<S>>{nodes, metric_, query, result}.run();
      return write_all(std::span{room.sorted}.first(result.size()));
    }
    heap_result<S> result{room.heap, spec.is_count_limited() ? capacity : capacity + 1, limit};
    kd_tree_search<S, D, M, heap_result<S>>{nodes, metric_, query, result}.run();
    result.sort();
    return write_all(room.heap);
  }

  void find(const S* query, const neighborhood_spec& spec, search_scratch<S>& room,
            std::vector<neighbor<S>>& out) const {
    out.clear();
    if constexpr (has_blocks) {
      const index_t k = std::min(spec.max_count(), nodes.searchable);
      if (spec.is_count_limited() && is_for_blocks(spec, nodes.searchable)) {
        if (k > 0 && is_searchable(query, D, nodes.largest))
          find_in_blocks<S, D>(nodes, query, k,
                               largest_sum_within(metric_, static_cast<S>(spec.max_distance())),
                               out);
        return;
      }
    }
    search(query, spec, room, [&](std::int32_t i, S distance) { out.push_back({i, distance}); });
  }

  M metric_;
};

template <Scalar S, int D, CoordinateMetric<S> M>
neighborhoods<S> kd_tree_engine<S, D, M>::find_all(points_view<S, D> queries,
                                                   const neighborhood_spec& spec,
                                                   const execution& how) const {
  if constexpr (has_blocks)
    if (is_for_blocks(spec, nodes.searchable))
      return find_all_in_blocks<S, D>(nodes, queries, spec, how);
  const index_t n = queries.size();
  const index_t k = std::min(spec.max_count(), nodes.searchable);
  const auto query = [&](index_t q) { return queries.data() + q * queries.stride(); };
  const bool plain_knn =
      spec.is_count_limited() && spec.max_distance() == std::numeric_limits<double>::infinity();
  // If k is large for this many queries, space for k neighbours is not reserved for each.
  if (!plain_knn ||
      k > std::int64_t{std::numeric_limits<std::int32_t>::max()} / std::max<index_t>(n, 1))
    return gather_neighborhoods<S>(n, how, finder(queries, spec));

  // k nearest neighbours: almost every query has exactly k, so that the place of each is known
  // beforehand.
  std::vector<index_t> offsets(static_cast<std::size_t>(n) + 1);
  buffer<std::int32_t> indices(n * k);
  buffer<S> distances(indices.size());
  parallel_blocks(n, query_block_size, how, [&](index_t, index_t begin, index_t end) {
    search_scratch<S> room;
    for (index_t q = begin; q < end; ++q) {
      auto at = static_cast<std::size_t>(q * k);
      offsets[static_cast<std::size_t>(q) + 1] =
          search(query(q), spec, room, [&](std::int32_t i, S distance) {
            indices[at] = i;
            distances[at++] = distance;
          });
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
  indices.resize(total);
  distances.resize(total);
  return {std::move(offsets), std::move(indices), std::move(distances)};
}

template <Scalar S, int D, CoordinateMetric<S> M>
void kd_tree_engine<S, D, M>::visit_all(points_view<S, D> queries, const neighborhood_spec& spec,
                                        const neighborhood_visitor<S>& visit,
                                        const visit_options& options) const {
  if constexpr (has_blocks)
    if (is_for_blocks(spec, nodes.searchable))
      return visit_in_blocks<S, D>(nodes, queries, spec, visit, options);
  visit_queries<S>(queries.size(), visit, options, finder(queries, spec));
}

/// Finds nearest neighbours in a set of points that does not change, by any `CoordinateMetric`.
///
/// The tree keeps a copy of the coordinates, in an order of its own that makes it fast; the
/// caller's points may change or go once it is built. Copies share one immutable tree, so that
/// copying is cheap and any copy may be used from any thread.
///
/// Points with a non-finite coordinate (or one beyond `largest_searchable_coordinate`) are never
/// found, and such queries find nothing; indices still count all points. At most 2³¹ − 1 points.
/// Memory: see `memory`; while it is built, additionally the size of the points. Building is O(N
/// log N); a query for k neighbours in low dimension is O(k log k + log N). Source: Bentley 1975;
/// Friedman, Bentley & Finkel 1977; the bounds are those of Arya & Mount 1993.
export template <Scalar S, int D, CoordinateMetric<S> M = euclidean>
class kd_tree {
 public:
  using scalar = S;
  static constexpr int static_dimension = D;

  /// Builds the same tree for any number of threads. Throws `invalid_input` for points of dimension
  /// 0 or of another dimension than the metric is for, for more than 2³¹ − 1 points, and for a
  /// `max_leaf_size` below 1; throws `cancelled`.
  template <PointsSource P>
    requires std::same_as<scalar_of<P>, S> && (D == dynamic || dimension_of<P> == D)
  explicit kd_tree(const P& points, const M& metric = {}, const kd_tree_options& options = {})
      : engine_{std::make_shared<const engine>(
            points_view<S, closed_dimension<D>>{points_in(points)}, metric, options)} {}
  template <PointsSource P>
    requires std::same_as<scalar_of<P>, S> && (D == dynamic || dimension_of<P> == D)
  kd_tree(const P& points, const kd_tree_options& options) : kd_tree{points, M{}, options} {}

  /// The number of points, including those that are never found.
  [[nodiscard]] index_t size() const { return engine_->nodes.size; }
  [[nodiscard]] index_t dimension() const { return engine_->nodes.dimension; }
  /// The memory of the tree, which its copies share, in bytes: about N · (Dim · sizeof(S) + 10).
  [[nodiscard]] std::size_t memory() const { return engine_->nodes.memory(); }

  /// Writes the neighbours of `query` to `out`, as `NeighborSearcher` says; reusing `out` saves
  /// allocations. Throws `invalid_input` if the dimensions differ.
  void find(const point_ref<S, D>& query, neighborhood_spec spec,
            std::vector<neighbor<S>>& out) const {
    expects(size() == 0 || query.size() == dimension(),
            "find: query and points must have the same dimension");
    engine_->find(query.data(), spec, out);
  }
  [[nodiscard]] std::vector<neighbor<S>> find(const point_ref<S, D>& query,
                                              neighborhood_spec spec) const {
    std::vector<neighbor<S>> out;
    find(query, spec, out);
    return out;
  }

  /// The nearest point, or nothing if there is none. Of several at the same distance, the one with
  /// the smallest index.
  [[nodiscard]] std::optional<neighbor<S>> nearest(const point_ref<S, D>& query) const {
    const auto found = find(query, knn{1});
    return found.empty() ? std::nullopt : std::optional{found.front()};
  }

  /// The two nearest points among those at most `max_distance` away; if there are fewer, the index
  /// of the missing ones is −1. For loops of many queries: nothing is allocated in 2 and 3
  /// dimensions. Throws `invalid_input` if the dimensions differ, or for a negative distance.
  [[nodiscard]] std::array<neighbor<S>, 2> nearest_two(
      const point_ref<S, D>& query, S max_distance = std::numeric_limits<S>::infinity()) const {
    expects(size() == 0 || query.size() == dimension(),
            "nearest_two: query and points must have the same dimension");
    expect_from(0, double(max_distance), "nearest_two: max_distance");
    constexpr neighbor<S> none{-1, std::numeric_limits<S>::infinity()};
    std::array<neighbor<S>, 2> found{none, none};
    engine_->nearest_two(query.data(), max_distance, found);
    return found;
  }

  /// The neighbourhoods of all `queries`, in parallel and in their order.
  /// Throws `invalid_input` if the dimensions differ.
  [[nodiscard]] neighborhoods<S> find_all(points_view<S, D> queries, neighborhood_spec spec,
                                          const execution& how = {}) const {
    expects(queries.empty() || size() == 0 || queries.dimension() == dimension(),
            "find_all: queries and points must have the same dimension");
    return engine_->find_all(queries, spec, how);
  }
  template <PointsSource P>
    requires std::same_as<points_view_of<P>, points_view<S, D>>
  [[nodiscard]] neighborhoods<S> find_all(const P& queries, neighborhood_spec spec,
                                          const execution& how = {}) const {
    return find_all(points_in(queries), spec, how);
  }

  /// Use `visit_neighborhoods` instead: it checks the arguments, and then calls this.
  void visit_all(points_view<S, D> queries, neighborhood_spec spec,
                 const neighborhood_visitor<S>& visit, const visit_options& options) const {
    engine_->visit_all(queries, spec, visit, options);
  }

  /// The nodes of the tree, for kernels of the library.
  [[nodiscard]] const auto& nodes() const { return engine_->nodes; }

 private:
  using engine = kd_tree_engine<S, closed_dimension<D>, M>;
  std::shared_ptr<const engine> engine_;
};

export template <PointsSource P>
kd_tree(const P&) -> kd_tree<scalar_of<P>, dimension_of<P>>;
export template <PointsSource P>
kd_tree(const P&, kd_tree_options) -> kd_tree<scalar_of<P>, dimension_of<P>>;
export template <PointsSource P, CoordinateMetric<scalar_of<P>> M>
kd_tree(const P&, M, kd_tree_options = {}) -> kd_tree<scalar_of<P>, dimension_of<P>, M>;

static_assert(NeighborSearcher<kd_tree<float, 3>> && BatchSearcher<kd_tree<float, 3>>);
static_assert(NeighborSearcher<kd_tree<double, dynamic, so3>>);

#define CILANTRO_COMPILED_ELSEWHERE(S, D)                \
  extern template struct kd_tree_nodes<S, D>;            \
  extern template class kd_tree_engine<S, D, euclidean>; \
  extern template class kd_tree_engine<S, D, manhattan>; \
  extern template class kd_tree_engine<S, D, chebyshev>; \
  extern template class kd_tree_engine<S, D, so2>;
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE
// Quaternions have four coordinates, for which the library is not compiled: as a run-time
// dimension.
extern template class kd_tree_engine<float, dynamic, so3>;
extern template class kd_tree_engine<double, dynamic, so3>;

}  // namespace cilantro
