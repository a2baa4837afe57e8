// SPDX-License-Identifier: MIT
module;
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>
module cilantro.numeric;

namespace cilantro {

/// Columns of blocks below the diagonal, in the order of elimination.
struct elimination {
  block_pattern pattern;
  index_t block;
  /// The node at each place, and the place of each node.
  std::vector<std::int32_t> nodes, places;
  std::vector<index_t> offsets{0};
  std::vector<std::int32_t> rows;
  /// For each block of the matrix where it goes: with the blocks of the diagonal first.
  std::vector<index_t> target;
};

namespace {

constexpr double negligible = 1e-12;

std::vector<std::int32_t> minimum_degree(const block_pattern& pattern) {
  const auto n = static_cast<int>(pattern.nodes());
  std::vector<Eigen::Triplet<double>> entries;
  for (int column = 0; column < n; ++column)
    for (index_t k = pattern.offsets()[column]; k < pattern.offsets()[column + 1]; ++k) {
      const int row = pattern.rows()[k];
      entries.emplace_back(row, column, 1);
      if (row != column) entries.emplace_back(column, row, 1);
    }
  Eigen::SparseMatrix<double> graph(n, n);
  graph.setFromTriplets(entries.begin(), entries.end());
  Eigen::AMDOrdering<int>::PermutationType order;
  if (n > 0) Eigen::AMDOrdering<int>{}(graph, order);
  return {order.indices().data(), order.indices().data() + n};
}

}  // namespace

block_cholesky::block_cholesky(block_pattern pattern, index_t block_size) {
  expects(0 < block_size, "block_cholesky: a block has at least one row");
  expects(pattern.nodes() <= std::numeric_limits<std::int32_t>::max() / block_size,
          "block_cholesky: there can be at most 2^31 - 1 unknowns");
  auto order = std::make_shared<elimination>(elimination{.pattern = std::move(pattern),
                                                         .block = block_size,
                                                         .nodes = {},
                                                         .places = {},
                                                         .rows = {},
                                                         .target = {}});
  const block_pattern& p = order->pattern;
  const index_t n = p.nodes();
  order->nodes = minimum_degree(p);
  order->places.resize(n);
  for (index_t i = 0; i < n; ++i) order->places[order->nodes[i]] = static_cast<std::int32_t>(i);
  std::vector<std::vector<std::int32_t>> below(n), children(n);
  for (index_t column = 0; column < n; ++column)
    for (index_t k = p.offsets()[column] + 1; k < p.offsets()[column + 1]; ++k) {
      const auto [a, b] = std::minmax(order->places[column], order->places[p.rows()[k]]);
      below[a].push_back(b);
    }
  for (index_t i = 0; i < n; ++i) {
    for (const auto c : children[i])
      for (const auto row : below[c])
        if (row > i) below[i].push_back(row);
    std::ranges::sort(below[i]);
    below[i].erase(std::ranges::unique(below[i]).begin(), below[i].end());
    if (!below[i].empty()) children[below[i].front()].push_back(static_cast<std::int32_t>(i));
    order->rows.insert(order->rows.end(), below[i].begin(), below[i].end());
    order->offsets.push_back(std::ssize(order->rows));
  }
  for (index_t column = 0; column < n; ++column)
    for (index_t k = p.offsets()[column]; k < p.offsets()[column + 1]; ++k) {
      const auto [a, b] = std::minmax(order->places[column], order->places[p.rows()[k]]);
      const auto found = std::lower_bound(below[a].begin(), below[a].end(), b);
      order->target.push_back(a == b ? a : n + order->offsets[a] + (found - below[a].begin()));
    }
  order_ = std::move(order);
}

const block_pattern& block_cholesky::pattern() const {
  return order_->pattern;
}
index_t block_cholesky::block_size() const {
  return order_->block;
}
index_t block_cholesky::size() const {
  return order_->pattern.nodes() * order_->block;
}

block_factor block_cholesky::factorize(std::span<const double> values) const {
  block_factor made;
  factorize(values, made);
  return made;
}

void block_cholesky::factorize(std::span<const double> values, block_factor& reused) const {
  const elimination& e = *order_;
  const index_t b = e.block, bb = b * b, n = e.pattern.nodes();
  reused.order_ = nullptr;
  reused.size_ = reused.undetermined_ = 0;
  expects(std::ssize(values) == e.pattern.blocks() * bb,
          "block_cholesky: there must be as many values as the pattern has");
  auto& all = reused.factor_;
  all.assign((n + std::ssize(e.rows)) * bb, 0);
  const auto block = [&](index_t k) { return all.data() + k * bb; };
  for (index_t column = 0; column < n; ++column)
    for (index_t k = e.pattern.offsets()[column]; k < e.pattern.offsets()[column + 1]; ++k) {
      const index_t row = e.pattern.rows()[k];
      double* to = block(e.target[k]);
      const bool turn = e.places[row] < e.places[column];
      for (index_t j = 0; j < b; ++j)
        for (index_t i = row == column ? j : 0; i < b; ++i) {
          const double v = values[k * bb + j * b + i];
          expects(std::isfinite(v), "block_cholesky: all values must be finite");
          to[turn ? i * b + j : j * b + i] = v;
        }
    }
  std::vector<double> least(n * b);
  for (index_t i = 0; i < n; ++i)
    for (index_t j = 0; j < b; ++j)
      least[i * b + j] = negligible * std::max(0.0, block(i)[j * b + j]);
  for (index_t i = 0; i < n; ++i) {
    double* d = block(i);
    const index_t begin = e.offsets[i], end = e.offsets[i + 1];
    const double* from = block(n + begin);
    for (index_t j = 0; j < b; ++j) {
      const double pivot = d[j * b + j];
      const bool is_determined = pivot > least[i * b + j] && std::isfinite(pivot);
      reused.undetermined_ += !is_determined;
      const double inverse = is_determined ? 1 / std::sqrt(pivot) : 0;
      d[j * b + j] = inverse;
      const auto scale = [&](double& v) { v = is_determined ? v * inverse : 0; };
      for (index_t r = j + 1; r < b; ++r) scale(d[j * b + r]);
      for (index_t k = n + begin; k < n + end; ++k)
        for (index_t r = 0; r < b; ++r) scale(block(k)[j * b + r]);
      for (index_t c = j + 1; c < b; ++c) {
        const double factor = d[j * b + c];
        for (index_t r = c; r < b; ++r) d[c * b + r] -= factor * d[j * b + r];
        for (index_t k = n + begin; k < n + end; ++k)
          for (index_t r = 0; r < b; ++r) block(k)[c * b + r] -= factor * block(k)[j * b + r];
      }
    }
    for (index_t p = begin; p < end; ++p) {
      const index_t column = e.rows[p];
      const auto first = e.rows.begin() + e.offsets[column],
                 last = e.rows.begin() + e.offsets[column + 1];
      for (index_t q = p; q < end; ++q) {
        const index_t at =
            q == p ? column : n + (std::lower_bound(first, last, e.rows[q]) - e.rows.begin());
        double* to = block(at);
        for (index_t c = 0; c < b; ++c)
          for (index_t r = 0; r < b; ++r)
            for (index_t j = 0; j < b; ++j)
              to[c * b + r] -=
                  from[(q - begin) * bb + j * b + r] * from[(p - begin) * bb + j * b + c];
      }
    }
  }
  // Only rows of undetermined unknowns can have overflowed; nothing depends on them.
  if (reused.undetermined_ > 0)
    for (double& v : all)
      if (!std::isfinite(v)) v = 0;
  reused.order_ = order_;
  reused.size_ = size();
}

void block_factor::solve(std::span<double> right_side) const {
  expects(std::ssize(right_side) == size_,
          "block_factor::solve: the right side must have as many numbers as there are unknowns");
  if (size_ == 0) return;
  const elimination& e = *order_;
  const index_t b = e.block, bb = b * b, n = e.pattern.nodes();
  std::vector<double> x(size_);
  const auto block = [&](index_t k) { return factor_.data() + k * bb; };
  for (index_t i = 0; i < n; ++i)
    std::copy_n(right_side.begin() + e.nodes[i] * b, b, x.begin() + i * b);
  for (index_t i = 0; i < n; ++i)
    for (index_t j = 0; j < b; ++j) {
      const double inverse = block(i)[j * b + j];
      const double value = x[i * b + j] = inverse > 0 ? x[i * b + j] * inverse : 0;
      for (index_t r = j + 1; r < b; ++r) x[i * b + r] -= block(i)[j * b + r] * value;
      for (index_t k = e.offsets[i]; k < e.offsets[i + 1]; ++k)
        for (index_t r = 0; r < b; ++r) x[e.rows[k] * b + r] -= block(n + k)[j * b + r] * value;
    }
  for (index_t i = n - 1; i >= 0; --i)
    for (index_t j = b - 1; j >= 0; --j) {
      double value = x[i * b + j];
      for (index_t r = j + 1; r < b; ++r) value -= block(i)[j * b + r] * x[i * b + r];
      for (index_t k = e.offsets[i]; k < e.offsets[i + 1]; ++k)
        for (index_t r = 0; r < b; ++r) value -= block(n + k)[j * b + r] * x[e.rows[k] * b + r];
      x[i * b + j] = value * block(i)[j * b + j];
    }
  for (index_t i = 0; i < n; ++i)
    std::copy_n(x.begin() + i * b, b, right_side.begin() + e.nodes[i] * b);
}

}  // namespace cilantro
