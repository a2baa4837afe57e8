// SPDX-License-Identifier: MIT
// message: 'NormalEquationSolver<
import cilantro;

struct no_solver {
  double operator()(const cilantro::normal_equations&) const { return 0; }
};

int main() {
  const Eigen::Matrix3Xf points(3, 10);
  const cilantro::least_squares_estimator estimator{points, points, cilantro::point_to_point{},
                                                    cilantro::rigid_motion{}, no_solver{}};
  return int(estimator.identity().matrix()(0, 0));
}
