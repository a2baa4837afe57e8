// SPDX-License-Identifier: MIT
//
// Searches for many queries at once, whose neighbourhoods are visited and discarded, or kept.
export module cilantro.search:visit;

import cilantro.standard;
import cilantro.core;
import :neighborhood;
import :neighbor_searcher;

namespace cilantro {

/// Options of `visit_neighborhoods`.
export struct visit_options {
  /// If not empty, one entry per query: 0 for queries that are skipped.
  std::span<const std::uint8_t> wanted = {};
  bool ascending = true;  ///< Whether neighbours come sorted by distance. Unsorted is faster.
  int threads = 0;
  task_monitor monitor = {};
};

/// A `NeighborSearcher` that answers many queries faster together than one after another, in an
/// order of its own: block by block, on another device, or tile by tile.
///
/// Semantics: `visit_all(queries, spec, visit, options)` passes the neighbourhoods of `queries` to
/// `visit`, in blocks of any size, and from several threads at once if it likes. Each finite query
/// that is wanted occurs exactly once, with the neighbours that `find` finds, by ascending distance
/// and index if `options.ascending`; queries that are not wanted do not occur; a query that is not
/// finite occurs without neighbours, or not at all. Exceptions of `visit` reach the caller, and
/// `options.monitor` is asked from time to time. Callers have checked sizes and dimensions.
/// `found_block` helps to make blocks. All functions of the library that take a searcher and many
/// queries use it: `find_neighborhoods`, graphs, components, densities.
/// Models: `kd_tree`; `check_neighbor_searcher` tests yours.
export template <class T>
concept VisitingSearcher =
    NeighborSearcher<T> &&
    requires(const T& searcher, points_view<typename T::scalar, T::static_dimension> queries,
             neighborhood_spec spec, const neighborhood_visitor<typename T::scalar>& visit,
             const visit_options& options) {
      { searcher.visit_all(queries, spec, visit, options) } -> std::same_as<void>;
    };

/// A `NeighborSearcher` with a fast way to find the neighbourhoods of many queries and return them
/// all.
///
/// Semantics: `find_all(queries, spec, how)` is what `find` finds for each query, in their order.
/// Models: `kd_tree`; `check_neighbor_searcher` tests yours. A `VisitingSearcher` does not need it.
export template <class T>
concept BatchSearcher =
    NeighborSearcher<T> &&
    requires(const T& searcher, points_view<typename T::scalar, T::static_dimension> queries,
             neighborhood_spec spec, const execution& how) {
      { searcher.find_all(queries, spec, how) } -> std::same_as<neighborhoods<typename T::scalar>>;
    };

/// How many queries a thread takes at a time; small, since the cost of radius searches varies.
inline constexpr index_t query_block_size = 256;

/// Collects the neighbourhoods of some queries: a `VisitingSearcher` fills one and passes its
/// `view()` to the visitor. Entry i is query number `queries[i]`, whose `counts[i]` neighbours
/// start at position `starts[i]` of `indices` and `distances`.
export template <Scalar S>
struct found_block {
  std::vector<std::int32_t> queries, counts;  ///< Query numbers, and their numbers of neighbours.
  std::vector<index_t> starts;                ///< Where the neighbours of each begin.
  buffer<std::int32_t> indices;
  buffer<S> distances;

  /// Adds a query and its neighbours, any range of `neighbor<S>`.
  template <std::ranges::sized_range R>
  void add(index_t query, const R& found) {
    begin(query, std::ranges::ssize(found));
    for (const neighbor<S> one : found) {
      indices.push_back(static_cast<std::int32_t>(one.index));
      distances.push_back(one.distance);
    }
  }
  /// Announces that the next `count` neighbours added to `indices` and `distances` are those of
  /// `query`.
  void begin(index_t query, index_t count) {
    queries.push_back(static_cast<std::int32_t>(query));
    starts.push_back(std::ssize(indices));
    counts.push_back(static_cast<std::int32_t>(count));
  }
  /// What has been collected, as a block; valid while this is not changed.
  [[nodiscard]] neighborhood_block<S> view() const {
    return {queries, starts, counts, indices, distances};
  }
};

/// How many neighbours are collected before a visitor gets them; the last query may exceed it.
inline constexpr std::size_t most_kept = std::size_t{1} << 18;

/// Searches for every q in [0, queries) that is wanted, in parallel. `make_find()` is called once
/// per block and returns a function `find(q, out)` that may keep what it needs between queries.
template <Scalar S, class F>
void visit_queries(index_t queries, const neighborhood_visitor<S>& visit,
                   const visit_options& options, F&& make_find) {
  const execution how{options.threads, options.monitor};
  parallel_blocks(queries, query_block_size, how, [&](index_t, index_t begin, index_t end) {
    found_block<S> block;
    auto find = make_find();
    std::vector<neighbor<S>> found;
    for (index_t q = begin; q < end; ++q) {
      if (!options.wanted.empty() && !options.wanted[q]) continue;
      find(q, found);
      block.add(q, found);
      if (block.indices.size() <= most_kept) continue;
      visit(block.view());
      block = found_block<S>{};
    }
    visit(block.view());
  });
}

/// Gathers blocks, which hold each query once or not at all, in the order of the queries.
template <Scalar S>
[[nodiscard]] neighborhoods<S> gather_blocks(index_t queries, std::vector<found_block<S>> blocks,
                                             int threads) {
  std::vector<index_t> offsets(static_cast<std::size_t>(queries) + 1, 0);
  for (const auto& block : blocks)
    for (std::size_t i = 0; i < block.queries.size(); ++i)
      offsets[static_cast<std::size_t>(block.queries[i]) + 1] = block.counts[i];
  for (std::size_t q = 1; q < offsets.size(); ++q) offsets[q] += offsets[q - 1];
  buffer<std::int32_t> indices(offsets.back());
  buffer<S> distances(indices.size());
  parallel_blocks(std::ssize(blocks), 1, {.threads = threads}, [&](index_t b, index_t, index_t) {
    auto& [names, counts, starts, found, how_far] = blocks[b];
    // Neighbours that follow one another in both places are copied together.
    for (std::size_t i = 0, next = 0; i < names.size(); i = next) {
      index_t count = counts[i];
      for (next = i + 1; next < names.size() && names[next] == names[next - 1] + 1 &&
                         starts[next] == starts[i] + count;
           ++next)
        count += counts[next];
      const index_t to = offsets[names[i]];
      std::copy_n(found.begin() + starts[i], count, indices.begin() + to);
      std::copy_n(how_far.begin() + starts[i], count, distances.begin() + to);
    }
    blocks[b] = {};
  });
  return {std::move(offsets), std::move(indices), std::move(distances)};
}

/// Searches for every q in [0, queries), in parallel, and gathers what is found. `make_find()` is
/// called once per block and returns a function `find(q, out)` that may keep what it needs between
/// queries.
template <Scalar S, class F>
[[nodiscard]] neighborhoods<S> gather_neighborhoods(index_t queries, const execution& how,
                                                    F&& make_find) {
  std::vector<found_block<S>> blocks((queries + query_block_size - 1) / query_block_size);
  parallel_blocks(queries, query_block_size, how, [&](index_t b, index_t begin, index_t end) {
    auto& block = blocks[b];
    auto find = make_find();
    std::vector<neighbor<S>> found;
    for (index_t q = begin; q < end; ++q) {
      find(q, found);
      block.add(q, found);
    }
  });

  return gather_blocks<S>(queries, std::move(blocks), how.threads);
}

/// Keeps what a visit finds for every query.
template <VisitingSearcher T>
[[nodiscard]] auto gather_visits(const T& searcher,
                                 points_view<typename T::scalar, T::static_dimension> queries,
                                 neighborhood_spec spec, const execution& how) {
  using S = typename T::scalar;
  std::mutex one_at_a_time;
  std::vector<found_block<S>> blocks;
  std::vector<bool> is_visited(queries.size());
  searcher.visit_all(queries, spec,
                     [&](const neighborhood_block<S>& block) {
                       found_block<S> kept;
                       for (index_t i = 0; i < block.size(); ++i)
                         kept.add(block.query(i), block[i]);
                       const std::scoped_lock lock{one_at_a_time};
                       for (const auto q : kept.queries) {
                         expects(0 <= q && q < queries.size() && !is_visited[q],
                                 "find_neighborhoods: the searcher visits a query that was not "
                                 "given, or visits one twice");
                         is_visited[q] = true;
                       }
                       blocks.push_back(std::move(kept));
                     },
                     {.threads = how.threads, .monitor = how.monitor});
  return gather_blocks<S>(queries.size(), std::move(blocks), how.threads);
}

/// The neighbourhoods of all `queries`, in parallel and in their order; the same for any number of
/// threads. Throws `invalid_input` if the dimensions differ.
export template <NeighborSearcher T>
[[nodiscard]] auto find_neighborhoods(const T& searcher,
                                      points_view<typename T::scalar, T::static_dimension> queries,
                                      neighborhood_spec spec, const execution& how = {}) {
  expects(queries.empty() || queries.dimension() == searcher.dimension(),
          "find_neighborhoods: queries and points must have the same dimension");
  expects(queries.size() <= std::numeric_limits<std::int32_t>::max(),
          "find_neighborhoods: there can be at most 2^31 - 1 queries");
  if constexpr (BatchSearcher<T>)
    return searcher.find_all(queries, spec, how);
  else if constexpr (VisitingSearcher<T>)
    return gather_visits(searcher, queries, spec, how);
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

/// Passes the neighbourhoods of `queries` to `visit`, a block at a time and from several threads at
/// once, and keeps none, so that memory does not grow with the number of queries. The searcher
/// chooses the order; each finite query that is wanted is visited once, a non-finite one once or
/// not at all. A block is valid only during the call of `visit`. Throws `invalid_input` if the
/// dimensions or sizes differ; what `visit` throws; `cancelled`.
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
          "visit_neighborhoods: `wanted` must be empty, or have one entry per query");
  static_assert(
      VisitingSearcher<T> || !requires { &T::visit_all; },
      "the searcher has a visit_all, but does not satisfy VisitingSearcher");
  if constexpr (VisitingSearcher<T>)
    searcher.visit_all(queries, spec, visit, options);
  else
    visit_queries<typename T::scalar>(queries.size(), visit, options, [&] {
      return [&](index_t q, auto& found) { searcher.find(queries[q], spec, found); };
    });
}

export template <NeighborSearcher T, PointsSource P>
void visit_neighborhoods(const T& searcher, const P& queries, neighborhood_spec spec,
                         const neighborhood_visitor<typename T::scalar>& visit,
                         const visit_options& options = {}) {
  visit_neighborhoods(searcher,
                      points_view<typename T::scalar, T::static_dimension>{points_in(queries)},
                      spec, visit, options);
}

}  // namespace cilantro
