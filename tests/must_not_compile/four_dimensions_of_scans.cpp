// SPDX-License-Identifier: MIT
// message: scans are clouds or points in two or three dimensions that are known
#include <vector>

import cilantro;

int main() {
  const std::vector<Eigen::Matrix4Xf> scans;
  (void)cilantro::align_many(scans, {.voxel = 0.05});
}
