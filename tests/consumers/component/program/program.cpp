// SPDX-License-Identifier: MIT
#include <limits>

import cilantro;
import cilantro.empty;

int main() {
  Eigen::Matrix3Xf points = Eigen::Matrix3Xf::Zero(3, 5);
  points(1, 2) = std::numeric_limits<float>::quiet_NaN();
  return cilantro::count_finite_points(cilantro::as_points(points)) == 4 ? 0 : 1;
}
