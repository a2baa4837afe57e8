// SPDX-License-Identifier: MIT
//
// Points of your own type, used where they lie: five lines of points_traits.
#include <iostream>
#include <vector>

import cilantro;

/// What some driver delivers: records of a laser scanner.
struct return_record {
  float x, y, z, intensity;
  unsigned ring, time;
};
struct laser_scan {
  std::vector<return_record> returns;
};

template <>
struct cilantro::points_traits<laser_scan> {
  static points_view<float, 3> view(const laser_scan& scan) {
    return {&scan.returns.data()->x, std::ssize(scan.returns),
            sizeof(return_record) / sizeof(float)};
  }
};

int main() {
  laser_scan scan;
  for (unsigned i = 0; i < 1000; ++i)
    scan.returns.push_back({float(i % 40), float(i / 40), 2, 0.5f, i % 16, i});

  const cilantro::kd_tree tree{scan};
  const auto [normals, curvature] = cilantro::estimate_normals(scan, cilantro::knn{9});
  const auto nearest = tree.nearest(Eigen::Vector3f{17.2f, 3.9f, 1});
  std::cout << "nearest to (17.2, 3.9, 1): "
            << cilantro::as_points(scan)[nearest->index].transpose()
            << ", normal there: " << normals.col(nearest->index).transpose() << '\n';
  return nearest->index == 4 * 40 + 17 && normals.cols() == 1000 ? 0 : 1;
}
