// SPDX-License-Identifier: MIT
//
// In which order the unknowns of a block pattern are eliminated, and in which fronts: computed once
// for a pattern.
module;
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "numeric/kernels/block_cholesky.hpp"
module cilantro.numeric:elimination;

import cilantro.core;
import cilantro.eigen;
import :block_cholesky;

namespace cilantro {

/// Nodes that are eliminated together, as their rows below are nearly the same.
struct front {
  /// Nodes are numbered as they are eliminated: the own ones are `first` and those behind it.
  std::int32_t first, columns;
  /// The front in which the first of its rows is eliminated, and which takes its update; −1 if it
  /// has none.
  std::int32_t parent;
  /// Its part of the lists below.
  index_t rows, rows_end, blocks, blocks_end, runs, runs_end;
  /// In the factor, and in the scratch memory.
  index_t panel, update;
  /// As in `detail::dense_front`.
  index_t panel_stride, update_stride, own_rows, rows_below;
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

using places = std::vector<std::int32_t>;

/// The places where a node's column of the factor has blocks, below the diagonal, and where each of
/// them comes from.
struct block_columns {
  std::vector<places> below;
  /// The first place below, or −1.
  places parents;
};

/// Nodes in an order that keeps the factor sparse.
places minimum_degree(const block_pattern& pattern) {
  const auto n = static_cast<int>(pattern.nodes());
  if (n == 0) return {};
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(2 * pattern.blocks());
  for (int column = 0; column < n; ++column)
    for (index_t k = pattern.offsets()[column]; k < pattern.offsets()[column + 1]; ++k) {
      const int row = pattern.rows()[k];
      entries.emplace_back(row, column, 1);
      if (row != column) entries.emplace_back(column, row, 1);
    }
  Eigen::SparseMatrix<double> graph(n, n);
  graph.setFromTriplets(entries.begin(), entries.end());
  Eigen::AMDOrdering<int>::PermutationType order;
  Eigen::AMDOrdering<int>{}(graph, order);
  return {order.indices().data(), order.indices().data() + n};
}

places inverse_of(const places& order) {
  places at(order.size());
  for (index_t i = 0; i < std::ssize(order); ++i) at[order[i]] = static_cast<std::int32_t>(i);
  return at;
}

block_columns columns_of(const block_pattern& pattern, const places& at) {
  const index_t n = pattern.nodes();
  block_columns found{std::vector<places>(n), places(n, -1)};
  std::vector<places> children(n);
  for (index_t column = 0; column < n; ++column)
    for (index_t k = pattern.offsets()[column] + 1; k < pattern.offsets()[column + 1]; ++k) {
      const auto [a, b] = std::minmax(at[column], at[pattern.rows()[k]]);
      found.below[a].push_back(b);
    }
  places seen(n, -1);
  for (std::int32_t i = 0; i < n; ++i) {
    places& below = found.below[i];
    seen[i] = i;
    for (const auto row : below) seen[row] = i;
    for (const auto c : children[i])
      for (const auto row : found.below[c])
        if (std::exchange(seen[row], i) != i) below.push_back(row);
    if (below.empty()) continue;
    found.parents[i] = std::ranges::min(below);
    children[found.parents[i]].push_back(i);
  }
  return found;
}

/// Columns that are eliminated together, before they are numbered.
struct column_group {
  places columns, children;
  double rows = 0, cost = 0;
};

/// About how long a front of that many unknowns takes, in multiplications.
double cost_of(double columns, double rows) {
  const double products = columns * (columns * columns / 3 + (columns + rows) * rows) / 2;
  const double numbers = columns * columns / 2 + columns * rows;
  const double update = rows * rows / 2;
  return products + 12 * numbers + 20 * update + 3000;
}

/// Joins columns with those that their parents are in wherever zeros that are stored cost less than
/// an update that is passed on.
std::vector<column_group> grouped(const block_columns& all, index_t block) {
  const index_t n = std::ssize(all.parents);
  std::vector<column_group> groups(n);
  const auto b = static_cast<double>(block);
  for (std::int32_t i = 0; i < n; ++i) {
    column_group& parent = groups[i];
    parent.rows = b * static_cast<double>(all.below[i].size());
    parent.columns = {i};
    parent.cost = cost_of(b, parent.rows);
    for (index_t k = 0; k < std::ssize(parent.children);) {
      column_group& child = groups[parent.children[k]];
      const double columns = b * static_cast<double>(child.columns.size() + parent.columns.size());
      const double cost = cost_of(columns, parent.rows);
      if (cost > child.cost + parent.cost) {
        ++k;
        continue;
      }
      parent.cost = cost;
      std::swap(parent.columns, child.columns);
      parent.columns.insert(parent.columns.end(), child.columns.begin(), child.columns.end());
      parent.children.erase(parent.children.begin() + k);
      parent.children.insert(parent.children.end(), child.children.begin(), child.children.end());
      child = {};
      k = 0;
    }
    if (all.parents[i] >= 0) groups[all.parents[i]].children.push_back(i);
  }
  return groups;
}

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
  places order, group_of_front, depths;
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
  for (index_t i = 0; i < count; ++i) {
    front& f = fronts[i];
    if (f.parent >= 0) f.parent = count - 1 - f.parent;
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
    f.own_rows = in_strips(f.columns * e.block);
    f.rows_below = in_strips((f.rows_end - f.rows) * e.block);
    f.panel_stride = stride_for(f.own_rows + f.rows_below);
    f.update_stride = stride_for(f.rows_below);
    f.panel = e.factor_size;
    e.factor_size += f.panel_stride * f.columns * e.block;
    f.update = tops[is_odd[i]];
    tops[is_odd[i]] += f.update_stride * f.rows_below;
    most[is_odd[i]] = std::max(most[is_odd[i]], tops[is_odd[i]]);
    if (bottoms[i] >= 0) tops[!is_odd[i]] = bottoms[i];
    if (f.parent >= 0 && bottoms[f.parent] < 0) bottoms[f.parent] = f.update;
    e.most_rows = std::max(e.most_rows, f.own_rows + f.rows_below);
    e.most_columns = std::max(e.most_columns, f.own_rows);
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
      f.own_rows + (std::ranges::lower_bound(rows, place) - rows.begin()) * e.block);
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
          to != parent.own_rows)
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
