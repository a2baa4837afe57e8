// SPDX-License-Identifier: MIT
//
// What a cell of a grid gathers is up to you: here the highest point and how many there are, which
// makes a height map of a scan. A plain struct with `add` and `merge`.
#include <algorithm>
#include <iostream>
#include <limits>
#include <utility>

import cilantro;
import simulated_room;
using namespace cilantro;

struct column_of_points {
  points_view<double, 3> points;
  double highest = -std::numeric_limits<double>::infinity();
  index_t count = 0;

  void add(index_t i) {
    highest = std::max(highest, points[i].z());
    ++count;
  }
  void merge(const column_of_points& later) {
    highest = std::max(highest, later.highest);
    count += later.count;
  }
};
static_assert(GridAccumulator<column_of_points>);

int main() {
  const Eigen::Matrix3Xd points = simulate(0, {.width = 160, .height = 120}).points;
  const column_of_points empty{as_points(points)};
  const auto violations = check_grid_accumulator(
      empty, points.cols(), [](const auto& c) { return std::pair{c.highest, c.count}; });
  for (const auto& violation : violations) std::cout << violation << '\n';

  // Cells as high as the room: one for each place on the floor.
  const voxel_grid grid{points, {{0.25, 0.25, 100}}, {.origin = {{0, 0, -50}}}};
  index_t total = 0;
  double highest = 0;
  const auto columns = accumulate(grid, empty);
  for (const auto& column : columns) {
    total += column.count;
    highest = std::max(highest, column.highest);
  }
  std::cout << grid.size() << " columns, the highest point of all at " << highest << " m\n";
  return violations.empty() && total == points.cols() && highest == points.row(2).maxCoeff() ? 0
                                                                                             : 1;
}
