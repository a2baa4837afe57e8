// SPDX-License-Identifier: MIT
module;
#include "registration/kernels/pair_graph.hpp"
module cilantro.registration;

import cilantro.eigen;
import :bit_graph;
import :pair_fit;

namespace cilantro {
namespace {

/// Edges that are looked at to find out how much a pair counts.
constexpr index_t most_edges = 128;
/// Pairs from which one transform is grown.
constexpr index_t largest_clique = 24;
/// Seeds that are grown at a time, whatever each of them finds.
constexpr index_t seeds_at_a_time = 8;

/// Pairs by coordinate, as kernels read them.
struct pair_columns {
  std::vector<float> values;
  detail::pair_list list = {};
  detail::pair_limits limits = {};

  template <int D>
  pair_columns(const putative_pairs<D>& pairs, double least, std::optional<double> cosine) {
    const index_t padded = (pairs.size() + 63) / 64 * 64;
    const bool has_normals = cosine && pairs.has_normals();
    values.assign(static_cast<std::size_t>(12 * padded), std::numeric_limits<float>::quiet_NaN());
    const auto place = [&](const auto& matrix, int first, const float** axes,
                           bool zero_is_unknown) {
      for (int d = 0; d < 3; ++d) {
        float* to = values.data() + (first + d) * padded;
        axes[d] = to;
        for (index_t i = 0; i < pairs.size(); ++i)
          if (!zero_is_unknown || !matrix.col(i).isZero(0))
            to[i] = d < D ? static_cast<float>(matrix(d < D ? d : 0, i)) : 0;
      }
    };
    place(pairs.source, 0, list.source, false);
    place(pairs.target, 3, list.target, false);
    if (has_normals) {
      place(pairs.source_normals, 6, list.source_normals, true);
      place(pairs.target_normals, 9, list.target_normals, true);
    }
    if (pairs.up)
      for (int d = 0; d < D; ++d) list.up[d] = static_cast<float>((*pairs.up)[d]);
    limits = {.length = static_cast<float>(pairs.max_distance),
              .least = static_cast<float>(least * pairs.max_distance),
              .cosine = static_cast<float>(cosine.value_or(0)),
              .oriented = pairs.oriented};
  }
};

pair_row_writer writer_of(pair_columns columns) {
  return [columns = std::make_shared<const pair_columns>(std::move(columns))](
             index_t i, std::span<std::uint64_t> row) {
    pair_kernels().row(columns->list, columns->limits, i, std::ssize(row), row.data());
  };
}

/// How much a pair counts: the neighbours that it shares with its neighbours, all together, of
/// which it looks at some.
double importance_of(const bit_graph& graph, index_t i) {
  const auto near = graph.neighbors(i);
  const index_t looked_at = std::min(std::ssize(near), most_edges);
  if (looked_at == 0) return 0;
  std::int64_t sum = 0;
  for (index_t k = 0; k < looked_at; ++k)
    sum += graph.shared(i, near[k * std::ssize(near) / looked_at]);
  return double(sum) * double(near.size()) / double(looked_at);
}

/// A clique around a pair, of those that share most neighbours with it.
index_list clique_around(const bit_graph& graph, index_t seed) {
  std::vector<std::pair<std::int64_t, std::int32_t>> by_shared;
  for (const auto j : graph.neighbors(seed)) by_shared.push_back({-graph.shared(seed, j), j});
  std::ranges::sort(by_shared);
  index_list members{static_cast<std::int32_t>(seed)};
  for (const auto& [count, j] : by_shared) {
    if (std::ssize(members) == largest_clique) break;
    if (std::ranges::all_of(members, [&](auto m) { return m == seed || graph.has_edge(m, j); }))
      members.push_back(j);
  }
  return members;
}

}  // namespace

void expect_seeds(int seeds) {
  expect_from(1, seeds, "pair_graph: seeds");
}

template <int D>
pair_row_writer row_writer(const putative_pairs<D>& pairs, const equal_lengths& invariant) {
  return writer_of({pairs, invariant.least, std::nullopt});
}
template <int D>
pair_row_writer row_writer(const putative_pairs<D>& pairs,
                           const equal_lengths_and_angles& invariant) {
  return writer_of({pairs, invariant.least, invariant.tolerance});
}

template <int D>
std::vector<pair_proposal<D>> propose_by_graph(const putative_pairs<D>& pairs,
                                               const pair_row_writer& write_row, const int& seeds,
                                               const execution& how) {
  const bit_graph graph{pairs.size(), write_row, how};
  std::vector<double> importance(static_cast<std::size_t>(graph.nodes()));
  parallel_blocks(graph.nodes(), 16, {.threads = how.threads}, [&](index_t, index_t b, index_t e) {
    for (index_t i = b; i < e; ++i) importance[i] = importance_of(graph, i);
  });
  index_list order(importance.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, {}, [&](auto i) { return std::pair{-importance[i], i}; });

  std::vector<pair_proposal<D>> proposals;
  std::vector<bool> is_explained(order.size());
  index_t next = 0;
  for (int grown = 0; grown < seeds && next < std::ssize(order);) {
    index_list some;
    for (; next < std::ssize(order) && std::ssize(some) < seeds_at_a_time; ++next)
      if (!is_explained[order[next]] && importance[order[next]] > 0) some.push_back(order[next]);
    if (some.empty()) break;
    grown += static_cast<int>(some.size());
    std::vector<std::optional<std::pair<pair_proposal<D>, agreement>>> found(some.size());
    parallel_blocks(std::ssize(some), 1, {.threads = how.threads},
                    [&](index_t k, index_t, index_t) {
                      const auto members = clique_around(graph, some[k]);
                      if (std::ssize(members) < D) return;
                      if (const auto proposal = fit_pairs<D>(pairs, members))
                        found[k] = refined<D>(pairs, *proposal);
                    });
    for (const auto& one : found) {
      if (!one) continue;
      proposals.push_back(one->first);
      for (const auto i : one->second.members) is_explained[i] = true;
    }
    if (how.monitor.stop.stop_requested()) throw cancelled{};
  }
  return proposals;
}

#define CILANTRO_INSTANTIATE(D)                                                           \
  template pair_row_writer row_writer<D>(const putative_pairs<D>&, const equal_lengths&); \
  template pair_row_writer row_writer<D>(const putative_pairs<D>&,                        \
                                         const equal_lengths_and_angles&);                \
  template std::vector<pair_proposal<D>> propose_by_graph<D>(                             \
      const putative_pairs<D>&, const pair_row_writer&, const int&, const execution&);
CILANTRO_INSTANTIATE(2)
CILANTRO_INSTANTIATE(3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
