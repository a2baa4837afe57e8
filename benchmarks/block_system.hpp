// SPDX-License-Identifier: MIT
//
// Equations as those of a field of motions on a surface: six unknowns a node, and blocks for pairs
// of nodes that are neighbours, or move the same points.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "common.hpp"

/// A symmetric matrix as 6 × 6 blocks, each column by column, and a right side.
struct block_system {
  static constexpr int block = 6;
  using values = std::array<double, std::size_t{block} * block>;

  int nodes = 0;
  /// Pairs of nodes, the larger first, in ascending order.
  std::vector<std::pair<std::int32_t, std::int32_t>> links;
  /// One for each node, and one for each link: below the diagonal.
  std::vector<values> diagonal, below;
  std::vector<double> right_side;

  explicit block_system(int count) : nodes{count} {
    link();
    fill();
  }

  /// The solution, if it is one.
  void report(benchmark::State& state, const double* x) const {
    std::vector<double> left = right_side;
    const auto subtract = [&](int row, int column, const values& v, bool is_transposed) {
      for (int j = 0; j < block; ++j)
        for (int i = 0; i < block; ++i)
          left[std::size_t(row * block + i)] -=
              v[std::size_t(is_transposed ? i * block + j : j * block + i)] * x[column * block + j];
    };
    for (int i = 0; i < nodes; ++i) subtract(i, i, diagonal[std::size_t(i)], false);
    for (std::size_t k = 0; k < links.size(); ++k) {
      subtract(links[k].first, links[k].second, below[k], false);
      subtract(links[k].second, links[k].first, below[k], true);
    }
    double square = 0, norm = 0;
    for (const double v : left) square += v * v;
    for (int i = 0; i < nodes * block; ++i) norm += x[i] * x[i];
    if (!(square < 1e-20 * double(right_side.size()))) state.SkipWithError("this is no solution");
    report_result(state, std::sqrt(norm));
  }

 private:
  using point = std::array<double, 3>;

  /// Across a surface with waves, of about 1.3 × 1.
  static point on_surface(double u, double v) {
    return {u, v, 0.08 * std::sin(7 * u) * std::cos(5 * v) + 0.05 * std::sin(13 * v)};
  }

  void link() {
    constexpr int neighbors = 8, anchors = 4, points_per_node = 20, reach = 4;
    const int rows = int(std::ceil(std::sqrt(nodes * 1.3))), columns = (nodes + rows - 1) / rows;
    plain_random random;
    std::vector<point> places;
    for (int i = 0; i < nodes; ++i) {
      const double u = i / columns + 0.6 * random(), v = i % columns + 0.6 * random();
      places.push_back(on_surface(u / columns, v / columns));
    }
    // The nearest are among those near on the grid.
    std::vector<std::pair<double, int>> near;
    const auto find = [&](double u, double v, int wanted) {
      const point at = on_surface(u / columns, v / columns);
      near.clear();
      for (int i = std::max(0, int(u) - reach); i <= std::min(rows - 1, int(u) + reach); ++i)
        for (int j = std::max(0, int(v) - reach); j <= std::min(columns - 1, int(v) + reach); ++j)
          if (const int node = i * columns + j; node < nodes) {
            double square = 0;
            for (std::size_t d = 0; d < 3; ++d)
              square += std::pow(places[std::size_t(node)][d] - at[d], 2);
            near.emplace_back(square, node);
          }
      std::partial_sort(near.begin(), near.begin() + wanted, near.end());
      near.resize(std::size_t(wanted));
    };
    for (int i = 0; i < nodes; ++i) {
      const point& p = places[std::size_t(i)];
      find(p[0] * columns, p[1] * columns, neighbors + 1);
      for (const auto& [distance, other] : near)
        if (other != i) links.emplace_back(std::max(i, other), std::min(i, other));
    }
    for (int i = 0; i < nodes * points_per_node; ++i) {
      find((rows - 1) * random(), (columns - 1) * random(), anchors);
      for (const auto& [d, a] : near)
        for (const auto& [e, b] : near)
          if (b < a) links.emplace_back(a, b);
    }
    std::sort(links.begin(), links.end());
    links.erase(std::unique(links.begin(), links.end()), links.end());
  }

  /// Six equations a link, with coefficients at random, and a little to each unknown.
  void fill() {
    plain_random random;
    diagonal.resize(std::size_t(nodes));
    below.resize(links.size());
    right_side.resize(std::size_t(nodes) * block);
    for (auto& d : diagonal)
      for (std::size_t i = 0; i < block; ++i) d[i * block + i] = 0.01;
    for (double& x : right_side) x = 2 * random() - 1;
    for (std::size_t k = 0; k < links.size(); ++k)
      for (int equation = 0; equation < block; ++equation) {
        std::array<double, block> a, b;
        for (double& x : a) x = 2 * random() - 1;
        for (double& x : b) x = 2 * random() - 1;
        for (std::size_t j = 0; j < block; ++j)
          for (std::size_t i = 0; i < block; ++i) {
            diagonal[std::size_t(links[k].first)][j * block + i] += a[i] * a[j];
            diagonal[std::size_t(links[k].second)][j * block + i] += b[i] * b[j];
            below[k][j * block + i] += a[i] * b[j];
          }
      }
  }
};

/// Factorises and solves it again and again. Each program has its own.
void block_system_of(benchmark::State& state, int nodes);

namespace {

void block_system_of_825_nodes(benchmark::State& state) {
  block_system_of(state, 825);
}
CILANTRO_BENCHMARK(block_system_of_825_nodes);
void block_system_of_1752_nodes(benchmark::State& state) {
  block_system_of(state, 1752);
}
CILANTRO_BENCHMARK(block_system_of_1752_nodes);
void block_system_of_6627_nodes(benchmark::State& state) {
  block_system_of(state, 6627);
}
CILANTRO_BENCHMARK(block_system_of_6627_nodes);

}  // namespace
