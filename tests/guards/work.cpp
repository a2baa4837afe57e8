// SPDX-License-Identifier: MIT
//
// How much a search looks at: nodes of the tree and distances, which only a worse tree or a worse
// walk changes. Ends with 1 if it is more than allowed, or so little that the number is due.
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <limits>
#include <vector>

#include "search/kernels/block_search.hpp"

import cilantro;
using namespace cilantro;

namespace cilantro::detail {
search_work counted_work = {};
}  // namespace cilantro::detail

namespace {

constexpr std::ptrdiff_t width = 16;

/// A wavy surface.
point_matrix<float, 3> surface(index_t n) {
  point_matrix<float, 3> points(3, n);
  random_stream random{1};
  for (auto p : points.colwise()) {
    const double x = random.uniform(0, 2), y = random.uniform(0, 2);
    p << float(x), float(y), float(0.1 * std::sin(5 * x) * std::cos(4 * y));
  }
  return points;
}

/// A hundredth more may come from another sine.
bool is_as_expected(const char* what, double found, double expected) {
  const bool is_right = found < 1.01 * expected && found > 0.9 * expected;
  std::cout << what << ": " << found;
  if (!is_right) std::cout << ", where it was " << expected;
  std::cout << '\n';
  return is_right;
}

}  // namespace

int main() {
  const auto points = surface(20'000);
  const kd_tree tree{as_points(points)};
  const auto blocks = detail::blocks_of<float>(tree.nodes());
  const auto& search = detail::block_search_in<detail::kernel_target::counting, float, 3>();
  const auto queries = static_cast<double>(points.cols());
  bool is_right = true;

  struct expected {
    int k;
    double nodes, distances;
  };
  for (const auto& [k, nodes, distances] :
       {expected{1, 10, 16}, {10, 20.76, 52.05}, {30, 25.31, 105.2}}) {
    detail::counted_work = {};
    std::vector<std::int32_t> rows(static_cast<std::size_t>(blocks.blocks * width)),
        indices(rows.size() * static_cast<std::size_t>(k));
    std::vector<float> found(indices.size());
    for (std::size_t r = 0; r < rows.size(); ++r) rows[r] = static_cast<std::int32_t>(r);
    search.nearest(blocks, blocks, 0, blocks.blocks, k, std::numeric_limits<float>::infinity(),
                   {rows.data(), indices.data(), found.data(), nullptr});
    std::cout << k << " nearest\n";
    is_right &= is_as_expected("  nodes a block of queries",
                               double(detail::counted_work.nodes) / double(blocks.blocks), nodes);
    is_right &= is_as_expected("  distances a query",
                               double(detail::counted_work.distances) / queries, distances);
  }

  detail::counted_work = {};
  constexpr float reach = 0.05f;
  std::vector<std::int32_t> near(static_cast<std::size_t>(blocks.blocks) + 1);
  std::vector<std::uint16_t> masks(near.size());
  std::vector<std::byte> room;
  std::vector<std::int32_t> indices;
  std::vector<float> found;
  for (std::ptrdiff_t b = 0; b < blocks.blocks; ++b) {
    const auto count =
        search.blocks_within(blocks, blocks, b, reach * reach, near.data(), masks.data());
    const auto most = static_cast<std::size_t>(count * width);
    room.resize(2 * most * detail::candidate_size + 64);
    indices.resize(most);
    found.resize(most);
    for (int q = 0; q < width && blocks.indices[b * width + q] >= 0; ++q)
      search.within(blocks, blocks, b, q, reach * reach, near.data(), masks.data(), count, false,
                    room.data(), indices.data(), found.data());
  }
  std::cout << "within 0.05\n";
  is_right &= is_as_expected("  nodes a block of queries",
                             double(detail::counted_work.nodes) / double(blocks.blocks), 23.64);
  is_right &= is_as_expected("  distances a query",
                             double(detail::counted_work.distances) / queries, 100.0);
  return is_right ? 0 : 1;
}
