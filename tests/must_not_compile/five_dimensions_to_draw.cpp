// SPDX-License-Identifier: MIT
// message: what is drawn has at most three dimensions
import cilantro.visualization;

int main() {
  const Eigen::Matrix<double, 5, 4> points = Eigen::Matrix<double, 5, 4>::Zero();
  return static_cast<int>(cilantro::scene{}.set("points", points).layers().size());
}
