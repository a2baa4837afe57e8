// SPDX-License-Identifier: MIT
module;
#include "search/kernels/block_search.hpp"
module cilantro.search;

namespace cilantro {
namespace {

constexpr index_t width = points_per_block;
/// Blocks of queries that are answered by one thread at a time.
constexpr index_t blocks_at_a_time = query_block_size / width;

template <Scalar S, int D>
const detail::block_search<S>& kernels() {
  return *detail::for_target(
      static_cast<int>(current_vector_target()),
      []<detail::kernel_target V> { return &detail::block_search_in<V, S, D>(); });
}

/// Whether the queries that can be answered are the points of the tree, in their order.
template <Scalar S, int D>
bool are_its_points(const kd_tree_nodes<S, D>& nodes, points_view<S, D> queries, int threads) {
  if (queries.size() != nodes.size) return false;
  const execution how{.threads = threads};
  const auto answerable =
      ordered_sum(queries.size(), how, index_t{0}, [&](index_t& count, index_t q) {
        count += is_searchable(queries.data() + q * queries.stride(), D, nodes.largest);
      });
  if (answerable != nodes.searchable) return false;
  std::atomic<bool> same = true;
  parallel_for(nodes.blocks(), how, [&](index_t b) {
    if (!same.load(std::memory_order_relaxed)) return;
    bool of_block = true;
    const S* at = nodes.block(b);
    const index_t count = std::min(width, nodes.searchable - b * width);
    for (index_t i = 0; i < count; ++i) {
      const S* query = queries.data() + nodes.indices[b * width + i] * queries.stride();
      for (index_t d = 0; d < D; ++d) of_block = of_block & (query[d] == at[d * width + i]);
    }
    if (!of_block) same = false;
  });
  return same;
}

/// A search for many queries, which are sorted into blocks like points; those of the tree itself
/// already are.
template <Scalar S, int D>
class block_queries {
 public:
  block_queries(const kd_tree_nodes<S, D>& nodes, points_view<S, D> queries,
                const neighborhood_spec& spec, int threads)
      : nodes_{nodes},
        tree_{detail::blocks_of<S>(nodes)},
        k_{std::min(spec.max_count(), nodes.searchable)},
        is_counted_{spec.is_count_limited()},
        limit_{largest_sum_within(euclidean{}, static_cast<S>(spec.max_distance()))} {
    if (are_its_points(nodes, queries, threads)) return;
    sorted_.emplace(queries, kd_tree_options{.threads = threads});
    queries_ = detail::blocks_of<S>(*sorted_);
  }

  /// How many blocks `find` takes.
  [[nodiscard]] index_t size() const {
    return (queries().blocks + blocks_at_a_time - 1) / blocks_at_a_time;
  }
  /// The number of neighbours that each query has, if that is known.
  [[nodiscard]] std::optional<index_t> row_size() const {
    if (is_counted_ && limit_ == std::numeric_limits<S>::infinity()) return k_;
    return std::nullopt;
  }
  [[nodiscard]] index_t answerable() const {
    return sorted_ ? sorted_->searchable : nodes_.searchable;
  }

  /// The nearest of the b-th block, each query's at its own row of `k` entries.
  void find_rows(index_t b, std::int32_t* indices, S* distances) const {
    if (k_ == 0) return;
    const auto [begin, end] = range(b);
    kernels<S, D>().nearest(tree_, queries(), begin, end, int(k_), limit_,
                            {queries().indices + begin * width, indices, distances, nullptr});
  }

  /// All that is found for the b-th block, of the queries that are wanted. `out` goes through
  /// `hand_on` whenever it holds much; what is in it in the end is the rest.
  template <class F>
  void find(index_t b, std::span<const std::uint8_t> wanted, bool ascending, found_block<S>& out,
            F hand_on) const {
    const auto [begin, end] = range(b);
    const auto is_wanted = [&](std::int32_t q) { return wanted.empty() || wanted[q]; };
    const auto of_block = indices_of(begin, end);
    if (std::ranges::none_of(of_block, is_wanted)) return;
    out.queries.reserve(of_block.size());
    out.starts.reserve(of_block.size());
    out.counts.reserve(of_block.size());
    if (is_counted_)
      find_nearest(begin, end, is_wanted, out);
    else
      find_within(begin, end, is_wanted, ascending, out, hand_on);
  }

 private:
  [[nodiscard]] const detail::block_tree<S>& queries() const { return sorted_ ? queries_ : tree_; }
  [[nodiscard]] std::pair<index_t, index_t> range(index_t b) const {
    return {b * blocks_at_a_time, std::min(queries().blocks, (b + 1) * blocks_at_a_time)};
  }
  [[nodiscard]] std::span<const std::int32_t> indices_of(index_t begin, index_t end) const {
    return {queries().indices + begin * width,
            queries().indices + std::min(end * width, answerable())};
  }

  template <class W>
  void find_nearest(index_t begin, index_t end, W is_wanted, found_block<S>& out) const {
    const auto of_block = indices_of(begin, end);
    std::array<std::int32_t, query_block_size> rows, counts;
    std::iota(rows.begin(), rows.end(), 0);
    out.indices.resize(of_block.size() * static_cast<std::size_t>(k_));
    out.distances.resize(out.indices.size());
    counts.fill(0);
    if (k_ > 0)
      kernels<S, D>().nearest(
          tree_, queries(), begin, end, int(k_), limit_,
          {rows.data(), out.indices.data(), out.distances.data(), counts.data()});
    for (std::size_t i = 0; i < of_block.size(); ++i) {
      if (!is_wanted(of_block[i])) continue;
      out.queries.push_back(of_block[i]);
      out.starts.push_back(index_t(i) * k_);
      out.counts.push_back(counts[i]);
    }
  }

  template <class W, class F>
  void find_within(index_t begin, index_t end, W is_wanted, bool ascending, found_block<S>& out,
                   F hand_on) const {
    const auto n = static_cast<std::size_t>(tree_.blocks);
    // Not cleared: of many, few are used.
    const auto blocks = std::make_unique_for_overwrite<std::int32_t[]>(n + 1);
    const auto masks = std::make_unique_for_overwrite<std::uint16_t[]>(n + 1);
    buffer<std::byte> room;
    for (index_t b = begin; b < end; ++b) {
      const index_t count =
          kernels<S, D>().blocks_within(tree_, queries(), b, limit_, blocks.get(), masks.get());
      const auto most = static_cast<std::size_t>(count * width);
      room.resize(std::max(room.size(), 2 * most * detail::candidate_size + 64));
      for (index_t i = 0; i < std::min(width, answerable() - b * width); ++i) {
        const std::int32_t q = queries().indices[b * width + i];
        if (!is_wanted(q)) continue;
        const auto at = out.indices.size();
        out.begin(q, 0);
        out.indices.resize(at + most);
        out.distances.resize(at + most);
        const index_t found = kernels<S, D>().within(
            tree_, queries(), b, int(i), limit_, blocks.get(), masks.get(), count, ascending,
            room.data(), out.indices.data() + at, out.distances.data() + at);
        out.counts.back() = static_cast<std::int32_t>(found);
        out.indices.resize(at + static_cast<std::size_t>(found));
        out.distances.resize(out.indices.size());
        if (out.indices.size() > most_kept) hand_on(out);
      }
    }
  }

  const kd_tree_nodes<S, D>& nodes_;
  std::optional<kd_tree_nodes<S, D>> sorted_;
  detail::block_tree<S> tree_, queries_ = {};
  index_t k_;
  bool is_counted_;
  S limit_;
};

}  // namespace

bool is_for_blocks(const neighborhood_spec& spec, index_t points) {
  return !spec.is_count_limited() ||
         std::min(spec.max_count(), points) <= detail::most_in_registers;
}

template <Scalar S, int D>
void find_in_blocks(const kd_tree_nodes<S, D>& nodes, const S* query, index_t k, S limit,
                    std::vector<neighbor<S>>& out) {
  // A block with one query.
  std::array<S, D * width> coordinates;
  std::array<std::int32_t, width> names;
  std::array<S, 8> box{};
  coordinates.fill(std::numeric_limits<S>::quiet_NaN());
  names.fill(-1);
  names[0] = 0;
  for (index_t d = 0; d < D; ++d) {
    const auto at = static_cast<std::size_t>(d);
    coordinates[at * std::size_t(width)] = box[at] = box[at + 4] = query[d];
  }
  std::array<std::int32_t, detail::most_in_registers> indices;
  std::array<S, detail::most_in_registers> distances;
  std::int32_t count = 0;
  kernels<S, D>().nearest(detail::blocks_of<S>(nodes),
                          {1, 0, coordinates.data(), names.data(), box.data(), nullptr}, 0, 1,
                          int(k), limit, {names.data(), indices.data(), distances.data(), &count});
  for (std::size_t i = 0; i < std::size_t(count); ++i) out.push_back({indices[i], distances[i]});
}

template <Scalar S, int D>
neighborhoods<S> find_all_in_blocks(const kd_tree_nodes<S, D>& nodes, points_view<S, D> queries,
                                    const neighborhood_spec& spec, const execution& how) {
  const block_queries<S, D> search{nodes, queries, spec, how.threads};
  const auto n = static_cast<std::size_t>(queries.size());
  if (const auto k = search.row_size(); k && search.answerable() == queries.size()) {
    // Each has exactly k and its place at once.
    buffer<std::int32_t> indices(n * static_cast<std::size_t>(*k));
    buffer<S> distances(indices.size());
    parallel_blocks(search.size(), 1, how, [&](index_t b, index_t, index_t) {
      search.find_rows(b, indices.data(), distances.data());
    });
    std::vector<index_t> offsets(n + 1);
    for (std::size_t q = 0; q <= n; ++q) offsets[q] = static_cast<index_t>(q) * *k;
    return {std::move(offsets), std::move(indices), std::move(distances)};
  }

  std::vector<index_t> offsets(n + 1);
  std::vector<found_block<S>> blocks(search.size());
  parallel_blocks(search.size(), 1, how, [&](index_t b, index_t, index_t) {
    auto& block = blocks[b];
    search.find(b, {}, true, block, [](const found_block<S>&) {});
    for (std::size_t i = 0; i < block.queries.size(); ++i)
      offsets[static_cast<std::size_t>(block.queries[i]) + 1] = block.counts[i];
  });
  std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
  buffer<std::int32_t> indices(offsets.back());
  buffer<S> distances(indices.size());
  parallel_blocks(search.size(), 1, {.threads = how.threads}, [&](index_t b, index_t, index_t) {
    auto& block = blocks[b];
    const auto found = block.view();
    for (index_t i = 0; i < found.size(); ++i) {
      const index_t at = offsets[found.query(i)];
      std::ranges::copy(found[i].indices(), indices.begin() + at);
      std::ranges::copy(found[i].distances(), distances.begin() + at);
    }
    block = {};
  });
  return {std::move(offsets), std::move(indices), std::move(distances)};
}

template <Scalar S, int D>
void visit_in_blocks(const kd_tree_nodes<S, D>& nodes, points_view<S, D> queries,
                     const neighborhood_spec& spec, const neighborhood_visitor<S>& visit,
                     const visit_options& options) {
  const block_queries<S, D> search{nodes, queries, spec, options.threads};
  const execution how{options.threads, options.monitor};
  parallel_blocks(search.size(), 1, how, [&](index_t b, index_t, index_t) {
    found_block<S> block;
    search.find(b, options.wanted, options.ascending, block, [&](found_block<S>& much) {
      visit(much.view());
      much = found_block<S>{};
    });
    visit(block.view());
  });
}

#define CILANTRO_INSTANTIATE(S, D)                                                                \
  template void find_in_blocks<S, D>(const kd_tree_nodes<S, D>&, const S*, index_t, S,            \
                                     std::vector<neighbor<S>>&);                                  \
  template neighborhoods<S> find_all_in_blocks<S, D>(                                             \
      const kd_tree_nodes<S, D>&, points_view<S, D>, const neighborhood_spec&, const execution&); \
  template void visit_in_blocks<S, D>(const kd_tree_nodes<S, D>&, points_view<S, D>,              \
                                      const neighborhood_spec&, const neighborhood_visitor<S>&,   \
                                      const visit_options&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
