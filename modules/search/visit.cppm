// SPDX-License-Identifier: MIT
//
// Many queries at once: visited and forgotten, or kept.
export module cilantro.search:visit;

import cilantro.standard;
import cilantro.core;
import :neighborhood;
import :neighbor_searcher;

namespace cilantro {

/// How neighbourhoods are visited.
export struct visit_options {
  /// If given, one for each query: 0 for those that are not asked.
  std::span<const std::uint8_t> wanted = {};
  bool ascending = true;  ///< Whether neighbours come in order; in any order is faster.
  int threads = 0;
  task_monitor monitor = {};
};

/// A `NeighborSearcher` that answers many queries faster than one after another, in an order of its
/// own: by blocks, on another device, from a tile at a time.
///
/// Semantics: `visit_all(queries, spec, visit, options)` hands the neighbourhoods of `queries` to
/// `visit`, in blocks of any size and from several threads at once if it likes: each finite query
/// that is wanted in one block and once, what `find` finds, by ascending distance and index if
/// `options.ascending`; no query that is not wanted; one that is not finite, with no neighbours or
/// not at all. It lets exceptions of `visit` out, and asks `options.monitor` now and then. Sizes
/// and dimensions have been checked. `found_block` makes blocks. What takes a searcher and many
/// queries goes through it: `find_neighborhoods`, graphs, components, densities.
/// Models: `kd_tree`; `check_neighbor_searcher` tests yours.
export template <class T>
concept VisitingSearcher =
    NeighborSearcher<T> &&
    requires(const T& searcher, points_view<typename T::scalar, T::static_dimension> queries,
             neighborhood_spec spec, const neighborhood_visitor<typename T::scalar>& visit,
             const visit_options& options) {
      { searcher.visit_all(queries, spec, visit, options) } -> std::same_as<void>;
    };

/// A `NeighborSearcher` that has a fast way to find the neighbourhoods of many queries and keep
/// them.
///
/// Semantics: `find_all(queries, spec, how)` is what `find` finds for each query, in their order.
/// Models: `kd_tree`; `check_neighbor_searcher` tests yours. One that is a `VisitingSearcher` need
/// not have it.
export template <class T>
concept BatchSearcher =
    NeighborSearcher<T> &&
    requires(const T& searcher, points_view<typename T::scalar, T::static_dimension> queries,
             neighborhood_spec spec, const execution& how) {
      { searcher.find_all(queries, spec, how) } -> std::same_as<neighborhoods<typename T::scalar>>;
    };

/// Queries answered by one thread at a time; small, since a radius search varies in cost.
inline constexpr index_t query_block_size = 256;

/// What is found for some queries, one after another: what a `VisitingSearcher` fills and hands on
/// as its `view()`.
export template <Scalar S>
struct found_block {
  std::vector<std::int32_t> queries, counts;
  std::vector<index_t> starts;
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

/// Asks for every q in [0, queries), in parallel, and gathers what is found. `make_find()` is
/// called once a block and returns a function `find(q, out)` that may keep what it needs between
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

/// What a visit finds of every query, kept.
template <VisitingSearcher T>
[[nodiscard]] auto gather_visits(const T& searcher,
                                 points_view<typename T::scalar, T::static_dimension> queries,
                                 neighborhood_spec spec, const execution& how) {
  using S = typename T::scalar;
  std::mutex one_at_a_time;
  std::vector<found_block<S>> blocks;
  std::vector<bool> is_visited(queries.size());
  searcher.visit_all(
      queries, spec,
      [&](const neighborhood_block<S>& block) {
        found_block<S> kept;
        for (index_t i = 0; i < block.size(); ++i) kept.add(block.query(i), block[i]);
        const std::scoped_lock lock{one_at_a_time};
        for (const auto q : kept.queries) {
          expects(0 <= q && q < queries.size() && !is_visited[q],
                  "find_neighborhoods: the searcher visits a query that is none, or one twice");
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
  static_assert(
      VisitingSearcher<T> || !requires { &T::visit_all; },
      "visit_all of the searcher is not as VisitingSearcher asks");
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
