// SPDX-License-Identifier: MIT
// message: does not satisfy 'BorrowedPoints'
import cilantro;

Eigen::Matrix3Xf scan();

int main() {
  return static_cast<int>(cilantro::as_points(scan()).size());
}
