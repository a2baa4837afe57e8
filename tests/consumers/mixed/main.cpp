// SPDX-License-Identifier: MIT
#include <iostream>
#include <string>

import cilantro;

int main() {
  long sum = 0;
#ifdef _OPENMP
#pragma omp parallel for reduction(+ : sum)
#endif
  for (int i = 0; i < 1000; ++i) sum += i;
  const Eigen::Matrix3Xf points = Eigen::Matrix3Xf::Ones(3, 100);
  const auto means = cilantro::voxel_downsample(points, 0.5);
  std::cout << std::string("consumed: ") << means.cols() << " voxel\n";
  return sum == 499500 && means.cols() == 1 ? 0 : 1;
}
