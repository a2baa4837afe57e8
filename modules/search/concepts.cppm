// SPDX-License-Identifier: MIT
export module cilantro.search:concepts;

import cilantro.standard;
import cilantro.core;
import :neighborhood;

namespace cilantro {

/// Finds the neighbours of a point among the points that it was built from.
///
/// Semantics: `find(query, spec, out)` clears `out` and writes the neighbours by ascending
/// distance, and by ascending index where points are equally far (before the rounding of a square
/// root): at most `spec.max_count()` of them, none farther than `spec.max_distance()`, which itself
/// still belongs. A query with a non-finite coordinate has no neighbours, and a point with one is
/// nobody's neighbour. `find` is const, depends on nothing but its arguments, and is called from
/// several threads at once. Complexity expected of a model: less than the number of points for a
/// small neighbourhood. Models: `kd_tree`, `brute_force_searcher`; `check_neighbor_searcher` tests
/// yours.
export template <class T>
concept NeighborSearcher =
    requires(const T& searcher,
             typename points_view<typename T::scalar, T::static_dimension>::point_type query,
             neighborhood_spec spec, std::vector<neighbor<typename T::scalar>>& out) {
      requires Scalar<typename T::scalar>;
      { searcher.size() } -> std::convertible_to<index_t>;
      { searcher.dimension() } -> std::convertible_to<index_t>;
      { searcher.find(query, spec, out) } -> std::same_as<void>;
    };

/// A searcher that has a faster way to answer many queries than one after another.
template <class T>
concept BatchSearcher =
    NeighborSearcher<T> &&
    requires(const T& searcher, points_view<typename T::scalar, T::static_dimension> queries,
             neighborhood_spec spec, const execution& how) {
      { searcher.find_all(queries, spec, how) } -> std::same_as<neighborhoods<typename T::scalar>>;
    };

export struct visit_options {
  /// If given, one for each query: 0 for those that are not asked.
  std::span<const std::uint8_t> wanted = {};
  bool ascending = true;  ///< Whether the order within a neighbourhood matters; none is faster.
  int threads = 0;
  task_monitor monitor = {};
};

/// A searcher that can hand on what it finds in an order of its own, which it is fast in.
template <class T>
concept VisitingSearcher =
    NeighborSearcher<T> &&
    requires(const T& searcher, points_view<typename T::scalar, T::static_dimension> queries,
             neighborhood_spec spec, const neighborhood_visitor<typename T::scalar>& visit,
             const visit_options& options) {
      { searcher.visit_all(queries, spec, visit, options) } -> std::same_as<void>;
    };

/// Queries answered by one thread at a time; small, since a radius search varies in cost.
inline constexpr index_t query_block_size = 256;

/// What is found for some queries, one after another.
template <Scalar S>
struct found_block {
  std::vector<std::int32_t> queries, counts;
  std::vector<index_t> starts;
  buffer<std::int32_t> indices;
  buffer<S> distances;

  void add(index_t query, std::span<const neighbor<S>> found) {
    begin(query, std::ssize(found));
    for (const auto& [index, distance] : found) {
      indices.push_back(static_cast<std::int32_t>(index));
      distances.push_back(distance);
    }
  }
  /// The next `count` entries will be those of `query`.
  void begin(index_t query, index_t count) {
    queries.push_back(static_cast<std::int32_t>(query));
    starts.push_back(std::ssize(indices));
    counts.push_back(static_cast<std::int32_t>(count));
  }
  [[nodiscard]] neighborhood_block<S> view() const {
    return {queries, starts, counts, indices, distances};
  }
};

/// So many neighbours are kept before a visitor gets them, and those of one more query.
inline constexpr std::size_t most_kept = std::size_t{1} << 18;

/// Asks for every q in [0, queries) that is wanted, in parallel. `make_find()` is called once a
/// block and returns a function `find(q, out)` that may keep what it needs between queries.
template <Scalar S, class F>
void visit_queries(index_t queries, const neighborhood_visitor<S>& visit,
                   const visit_options& options, F&& make_find) {
  const execution how{options.threads, options.monitor};
  parallel_blocks(queries, query_block_size, how, [&](index_t, index_t begin, index_t end) {
    found_block<S> block;
    auto find = make_find();
    std::vector<neighbor<S>> found;
    for (index_t q = begin; q < end; ++q) {
      if (!options.wanted.empty() && !options.wanted[static_cast<std::size_t>(q)]) continue;
      find(q, found);
      block.add(q, found);
      if (block.indices.size() <= most_kept) continue;
      visit(block.view());
      block = found_block<S>{};
    }
    visit(block.view());
  });
}

/// Asks for every q in [0, queries), in parallel, and gathers what is found. `make_find()` is
/// called once a block and returns a function `find(q, out)` that may keep what it needs between
/// queries.
template <Scalar S, class F>
[[nodiscard]] neighborhoods<S> gather_neighborhoods(index_t queries, const execution& how,
                                                    F&& make_find) {
  std::vector<found_block<S>> blocks(
      static_cast<std::size_t>((queries + query_block_size - 1) / query_block_size));
  parallel_blocks(queries, query_block_size, how, [&](index_t b, index_t begin, index_t end) {
    auto& block = blocks[static_cast<std::size_t>(b)];
    auto find = make_find();
    std::vector<neighbor<S>> found;
    for (index_t q = begin; q < end; ++q) {
      find(q, found);
      block.add(q, found);
    }
  });

  std::vector<index_t> offsets{0};
  offsets.reserve(static_cast<std::size_t>(queries) + 1);
  for (const auto& block : blocks)
    for (const std::int32_t count : block.counts) offsets.push_back(offsets.back() + count);
  buffer<std::int32_t> indices(static_cast<std::size_t>(offsets.back()));
  buffer<S> distances(indices.size());
  parallel_blocks(std::ssize(blocks), 1, {.threads = how.threads},
                  [&](index_t b, index_t, index_t) {
                    auto& block = blocks[static_cast<std::size_t>(b)];
                    const index_t at = offsets[static_cast<std::size_t>(b * query_block_size)];
                    std::ranges::copy(block.indices, indices.begin() + at);
                    std::ranges::copy(block.distances, distances.begin() + at);
                    block = {};
                  });
  return {std::move(offsets), std::move(indices), std::move(distances)};
}

/// The neighbourhoods of all `queries`, in parallel and in their order; the same for any number of
/// threads. Throws `invalid_input` if the dimensions differ.
export template <NeighborSearcher T>
[[nodiscard]] auto find_neighborhoods(const T& searcher,
                                      points_view<typename T::scalar, T::static_dimension> queries,
                                      neighborhood_spec spec, const execution& how = {}) {
  expects(queries.empty() || queries.dimension() == searcher.dimension(),
          "find_neighborhoods: queries and points must have the same dimension");
  if constexpr (BatchSearcher<T>)
    return searcher.find_all(queries, spec, how);
  else
    return gather_neighborhoods<typename T::scalar>(queries.size(), how, [&] {
      return [&](index_t q, auto& found) { searcher.find(queries[q], spec, found); };
    });
}
export template <NeighborSearcher T, PointsSource P>
[[nodiscard]] auto find_neighborhoods(const T& searcher, const P& queries, neighborhood_spec spec,
                                      const execution& how = {}) {
  return find_neighborhoods(
      searcher, points_view<typename T::scalar, T::static_dimension>{points_in(queries)}, spec,
      how);
}

/// Hands the neighbourhoods of `queries` to `visit`, a block of them at a time and from several
/// threads at once, and keeps none: memory does not grow with their number. A searcher visits them
/// in the order that it is fast in: each finite query that is wanted once, others perhaps not at
/// all. What a block holds is gone after the call.
/// Throws `invalid_input` if the dimensions or sizes differ; what `visit` throws; `cancelled`.
export template <NeighborSearcher T>
void visit_neighborhoods(const T& searcher,
                         points_view<typename T::scalar, T::static_dimension> queries,
                         neighborhood_spec spec,
                         const neighborhood_visitor<typename T::scalar>& visit,
                         const visit_options& options = {}) {
  expects(queries.empty() || queries.dimension() == searcher.dimension(),
          "visit_neighborhoods: queries and points must have the same dimension");
  expects(queries.size() <= std::numeric_limits<std::int32_t>::max(),
          "visit_neighborhoods: there can be at most 2^31 - 1 queries");
  expects(options.wanted.empty() || std::ssize(options.wanted) == queries.size(),
          "visit_neighborhoods: it must be said for each query whether it is wanted");
  if constexpr (VisitingSearcher<T>)
    searcher.visit_all(queries, spec, visit, options);
  else
    visit_queries<typename T::scalar>(queries.size(), visit, options, [&] {
      return [&](index_t q, auto& found) { searcher.find(queries[q], spec, found); };
    });
}

}  // namespace cilantro
