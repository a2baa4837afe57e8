// SPDX-License-Identifier: MIT
//
// Graphs as rows of bits.
module;
#include "registration/kernels/pair_graph.hpp"
module cilantro.registration:bit_graph;

import cilantro.standard;
import cilantro.core;
import :pair_graph;

namespace cilantro {

inline const detail::pair_graph& pair_kernels() {
  return *detail::for_target(static_cast<int>(current_vector_target()),
                             []<detail::kernel_target V> { return &detail::pair_graph_in<V>(); });
}

/// A graph without loops, whose row of node i has bit j if they are neighbours: N²/8 bytes.
class bit_graph {
 public:
  bit_graph(index_t nodes, const pair_row_writer& write_row, const execution& how)
      : nodes_{nodes}, words_{(nodes + 63) / 64}, bits_(static_cast<std::size_t>(nodes * words_)) {
    parallel_blocks(nodes, 16, how, [&](index_t, index_t begin, index_t end) {
      for (index_t i = begin; i < end; ++i) {
        const std::span all{bits_.data() + i * words_, static_cast<std::size_t>(words_)};
        write_row(i, all);
        all[i / 64] &= ~(std::uint64_t{1} << (i % 64));
      }
    });
  }

  [[nodiscard]] index_t nodes() const { return nodes_; }
  [[nodiscard]] index_t words() const { return words_; }
  [[nodiscard]] const std::uint64_t* row(index_t i) const { return bits_.data() + i * words_; }
  [[nodiscard]] bool has_edge(index_t i, index_t j) const { return row(i)[j / 64] >> (j % 64) & 1; }

  [[nodiscard]] index_list neighbors(index_t i) const {
    index_list all;
    for (index_t w = 0; w < words_; ++w)
      for (std::uint64_t rest = row(i)[w]; rest != 0; rest &= rest - 1)
        all.push_back(static_cast<std::int32_t>(w * 64 + std::countr_zero(rest)));
    return all;
  }
  /// How many neighbours two nodes have in common.
  [[nodiscard]] std::int64_t shared(index_t i, index_t j) const {
    return pair_kernels().shared(row(i), row(j), words_);
  }

  /// Keeps some of the edges: those that `keep(i, j)` is true for, seen from either end; all are
  /// decided by the graph as it was. Returns whether any was dropped.
  template <class Keep>
  bool keep_edges(const execution& how, Keep keep) {
    std::vector<std::uint64_t> kept(bits_.size());
    std::vector<char> is_changed(static_cast<std::size_t>(nodes_));
    parallel_blocks(nodes_, 16, how, [&](index_t, index_t begin, index_t end) {
      for (index_t i = begin; i < end; ++i)
        for (const auto j : neighbors(i)) {
          if (keep(i, j))
            kept[i * words_ + j / 64] |= std::uint64_t{1} << (j % 64);
          else
            is_changed[i] = 1;
        }
    });
    bits_ = std::move(kept);
    for (const char c : is_changed)
      if (c) return true;
    return false;
  }

 private:
  index_t nodes_, words_;
  std::vector<std::uint64_t> bits_;
};

}  // namespace cilantro
