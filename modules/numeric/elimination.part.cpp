// SPDX-License-Identifier: MIT
//
// The fronts in which the unknowns of a block pattern are eliminated, and where everything is in
// memory: computed once for a pattern.
module;
#include "numeric/kernels/block_cholesky.hpp"
module cilantro.numeric:elimination;

import cilantro.standard;
import cilantro.core;
import :block_cholesky;
import :column_groups;

namespace cilantro {

/// Nodes that are eliminated together, as their rows below are nearly the same.
struct front {
  /// Nodes are numbered as they are eliminated: the own ones are `first` and those behind it.
  std::int32_t first, columns;
  /// The front in which the first of its rows is eliminated, and which takes its update; −1 if it
  /// has none.
  std::int32_t parent;
  /// The last of those whose updates it takes, and the one before it that has the same parent; −1
  /// if there is none.
  std::int32_t child, sibling;
  /// Its part of the lists below.
  index_t rows, rows_end, blocks, blocks_end, runs, runs_end;
  /// In the factor, and in the scratch memory.
  index_t panel, update;
  detail::front_shape shape;
};

struct elimination {
  block_pattern pattern;
  index_t block;
  /// The node at each place of the order.
  std::vector<std::int32_t> nodes;
  /// Children before their parents.
  std::vector<front> fronts;
  /// Blocks of rows below the own ones of each front, as places.
  std::vector<std::int32_t> rows;
  std::vector<detail::placed_block> blocks;
  /// Where each front's update goes in its parent.
  std::vector<detail::row_run> runs;
  /// How many numbers the factor and the scratch memory hold.
  index_t factor_size, scratch_size, most_rows, most_columns;
};

index_t in_strips(index_t rows) {
  return (rows + detail::front_strip - 1) / detail::front_strip * detail::front_strip;
}

/// Columns that are powers of two apart would share few lines of the cache.
index_t stride_for(index_t rows) {
  return rows % 128 == 0 ? rows + detail::front_strip : rows;
}

/// Numbers the groups, children first, and lists their rows.
void number(elimination& e, const block_columns& all, const std::vector<column_group>& groups) {
  const index_t n = std::ssize(groups);
  places order, group_of_front;
  std::vector<std::pair<std::int32_t, std::int32_t>> waiting;
  // Parents first, and all backwards.
  for (std::int32_t i = 0; i < n; ++i)
    if (all.parents[i] < 0) waiting.emplace_back(i, -1);
  std::vector<front> fronts;
  while (!waiting.empty()) {
    const auto [group, parent] = waiting.back();
    waiting.pop_back();
    const auto at = static_cast<std::int32_t>(fronts.size());
    const column_group& g = groups[group];
    front f{};
    f.parent = parent;
    f.child = f.sibling = -1;
    f.columns = static_cast<std::int32_t>(g.columns.size());
    fronts.push_back(f);
    group_of_front.push_back(group);
    order.insert(order.end(), g.columns.rbegin(), g.columns.rend());
    for (const auto child : g.children) waiting.emplace_back(child, at);
  }
  std::ranges::reverse(order);
  std::ranges::reverse(fronts);
  std::ranges::reverse(group_of_front);
  const places at = inverse_of(order);
  const auto count = static_cast<std::int32_t>(fronts.size());
  std::int32_t first = 0;
  for (std::int32_t i = 0; i < count; ++i) {
    front& f = fronts[i];
    if (f.parent >= 0) {
      f.parent = count - 1 - f.parent;
      f.sibling = std::exchange(fronts[f.parent].child, i);
    }
    f.first = std::exchange(first, first + f.columns);
    f.rows = std::ssize(e.rows);
    for (const auto row : all.below[group_of_front[i]]) e.rows.push_back(at[row]);
    f.rows_end = std::ssize(e.rows);
    std::sort(e.rows.begin() + f.rows, e.rows.end());
  }
  places nodes(n);
  for (index_t i = 0; i < n; ++i) nodes[i] = e.nodes[order[i]];
  e.nodes = std::move(nodes);
  e.fronts = std::move(fronts);
}

/// Where panels and updates are in memory. An update waits from when it is computed until its
/// parent takes it; those of parents and of children grow from two ends, so that each end is a
/// stack.
void lay_out(elimination& e) {
  std::vector<bool> is_odd(e.fronts.size());
  std::array<index_t, 2> tops{}, most{};
  for (index_t i = std::ssize(e.fronts) - 1; i >= 0; --i)
    is_odd[i] = e.fronts[i].parent >= 0 && !is_odd[e.fronts[i].parent];
  std::vector<index_t> bottoms(e.fronts.size(), -1);
  for (index_t i = 0; i < std::ssize(e.fronts); ++i) {
    front& f = e.fronts[i];
    const index_t own = in_strips(f.columns * e.block);
    const index_t below = in_strips((f.rows_end - f.rows) * e.block);
    f.shape = {.panel_stride = stride_for(own + below),
               .update_stride = stride_for(below),
               .columns = static_cast<int>(f.columns * e.block),
               .own_rows = static_cast<int>(own),
               .rows_below = static_cast<int>(below)};
    f.panel = e.factor_size;
    e.factor_size += f.shape.panel_stride * f.shape.columns;
    f.update = tops[is_odd[i]];
    tops[is_odd[i]] += f.shape.update_stride * below;
    most[is_odd[i]] = std::max(most[is_odd[i]], tops[is_odd[i]]);
    if (bottoms[i] >= 0) tops[!is_odd[i]] = bottoms[i];
    if (f.parent >= 0 && bottoms[f.parent] < 0) bottoms[f.parent] = f.update;
    e.most_rows = std::max(e.most_rows, own + below);
    e.most_columns = std::max(e.most_columns, own);
  }
  for (index_t i = 0; i < std::ssize(e.fronts); ++i)
    if (is_odd[i]) e.fronts[i].update += most[0];
  e.scratch_size = most[0] + most[1];
}

/// The row of a place in a front's panel.
std::int32_t row_in(const elimination& e, const front& f, std::int32_t place) {
  const auto own = place - f.first;
  if (own < f.columns) return static_cast<std::int32_t>(own * e.block);
  const auto rows = std::span{e.rows}.subspan(f.rows, f.rows_end - f.rows);
  return static_cast<std::int32_t>(
      f.shape.own_rows + (std::ranges::lower_bound(rows, place) - rows.begin()) * e.block);
}

/// Which rows of each front follow each other in its parent.
void find_runs(elimination& e) {
  for (front& f : e.fronts) {
    f.runs = std::ssize(e.runs);
    for (index_t k = f.rows; k < f.rows_end; ++k) {
      const front& parent = e.fronts[f.parent];
      const auto to = row_in(e, parent, e.rows[k]);
      const auto block = static_cast<std::int32_t>(e.block);
      if (std::ssize(e.runs) > f.runs && e.runs.back().to + e.runs.back().length == to &&
          to != parent.shape.own_rows)
        e.runs.back().length += block;
      else
        e.runs.push_back({static_cast<std::int32_t>((k - f.rows) * e.block), to, block});
    }
    f.runs_end = std::ssize(e.runs);
  }
}

/// Where the blocks of the matrix go.
void place_blocks(elimination& e) {
  const places at = inverse_of(e.nodes);
  places front_of(at.size());
  for (index_t i = 0; i < std::ssize(e.fronts); ++i)
    std::fill_n(front_of.begin() + e.fronts[i].first, e.fronts[i].columns,
                static_cast<std::int32_t>(i));
  const block_pattern& p = e.pattern;
  const auto each = [&](const auto& visit) {
    for (index_t column = 0; column < p.nodes(); ++column)
      for (index_t k = p.offsets()[column]; k < p.offsets()[column + 1]; ++k)
        visit(k, at[p.rows()[k]], at[column]);
  };
  each([&](index_t, std::int32_t a, std::int32_t b) {
    ++e.fronts[front_of[std::min(a, b)]].blocks_end;
  });
  index_t sum = 0;
  for (front& f : e.fronts) {
    f.blocks = sum;
    sum += std::exchange(f.blocks_end, sum);
  }
  e.blocks.resize(sum);
  each([&](index_t slot, std::int32_t a, std::int32_t b) {
    front& f = e.fronts[front_of[std::min(a, b)]];
    e.blocks[f.blocks_end++] = {slot, row_in(e, f, std::max(a, b)), row_in(e, f, std::min(a, b)),
                                a < b};
  });
}

std::shared_ptr<const elimination> analyzed(block_pattern pattern, index_t block) {
  auto e = std::make_shared<elimination>(
      elimination{std::move(pattern), block, {}, {}, {}, {}, {}, 0, 0, 0, 0});
  e->nodes = minimum_degree(e->pattern);
  const auto columns = columns_of(e->pattern, inverse_of(e->nodes));
  number(*e, columns, grouped(columns, block));
  lay_out(*e);
  find_runs(*e);
  place_blocks(*e);
  return e;
}

}  // namespace cilantro
