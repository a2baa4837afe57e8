// SPDX-License-Identifier: MIT
// message: does not satisfy 'NormalEquationSolver'
import cilantro;

struct no_solver {
  double operator()(const cilantro::normal_equations&) const { return 0; }
};

int main() {
  const Eigen::Matrix3Xf points(3, 10);
  const cilantro::least_squares_estimator<float, 3, cilantro::point_to_point,
                                          cilantro::rigid_motion, no_solver>
      estimator{points, points};
  return int(estimator.identity().matrix()(0, 0));
}
