// SPDX-License-Identifier: MIT
//
// A map of your own, which moves each point in its own way: a board that sags, held at both ends.
// The library's searchers pair under it as they do under a transform.
#include <cmath>
#include <iostream>
#include <numbers>

import cilantro;
using namespace cilantro;

/// Along x from 0 to 1 the board hangs through by `depth` in the middle.
struct sagging_board {
  using Scalar = double;
  double depth;

  Eigen::Vector3d operator()(index_t, const Eigen::Vector3d& p) const {
    return {p.x(), p.y(), p.z() - depth * std::sin(std::numbers::pi * p.x())};
  }
};

int main() {
  Eigen::Matrix3Xd board(3, 101 * 21);
  for (index_t i = 0; i < board.cols(); ++i)
    board.col(i) << 0.01 * double(i % 101), 0.01 * double(i / 101), 0;
  const auto sagged = moved_points(sagging_board{0.03}, board);
  for (const auto& sentence : check_point_map(sagging_board{0.03}, board))
    std::cout << sentence << '\n';

  const nearest_neighbor_searcher searcher{board, sagged};
  const auto rmse_under = [&](double depth) {
    correspondences<double> pairs;
    searcher.find(sagging_board{depth}, pairs);
    double sum = 0;
    for (const auto& pair : pairs) sum += pair.distance * pair.distance;
    return std::sqrt(sum / double(pairs.size()));
  };
  double best = 0;
  for (double depth = 0; depth <= 0.05; depth += 0.0025)
    if (rmse_under(depth) < rmse_under(best)) best = depth;
  std::cout << "the board hangs through by " << best << " m\n";
  return std::abs(best - 0.03) < 0.0013 ? 0 : 1;
}
