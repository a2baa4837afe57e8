// SPDX-License-Identifier: MIT
import ground;

int main() {
  cilantro::point_cloud<float, 3> scan{.points = Eigen::Matrix3Xf::Zero(3, 10)};
  scan.points(2, 4) = 1;
  return without_ground(scan).size() == 1 ? 0 : 1;
}
