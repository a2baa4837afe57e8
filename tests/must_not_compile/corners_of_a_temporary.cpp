// SPDX-License-Identifier: MIT
// message: will be destroyed at the end of the full-expression
import cilantro;

int main() {
  const Eigen::Matrix3Xd points(3, 10);
  const auto corners = cilantro::convex_hull(points).vertices();
  return corners.empty();
}
