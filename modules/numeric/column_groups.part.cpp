// SPDX-License-Identifier: MIT
//
// In which order the nodes of a block pattern are eliminated, and which of them together.
module cilantro.numeric:column_groups;

import cilantro.standard;
import cilantro.core;
import cilantro.eigen;
import :block_cholesky;

namespace cilantro {

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
      parent.children[k] = parent.children.back();
      parent.children.pop_back();
      parent.children.insert(parent.children.end(), child.children.begin(), child.children.end());
      child = {};
    }
    if (all.parents[i] >= 0) groups[all.parents[i]].children.push_back(i);
  }
  return groups;
}

}  // namespace cilantro
