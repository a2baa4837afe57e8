// SPDX-License-Identifier: MIT
module cilantro.registration;

namespace cilantro {

normal_solution truncated_solver::operator()(const normal_equations& equations) const {
  expect_from(0, min_eigenvalue, "truncated_solver: min_eigenvalue");
  const index_t u = equations.gradient.size();
  // Unknowns in different units are first made comparable.
  const Eigen::VectorXd scale = equations.motion.diagonal().unaryExpr(
      [](double m) { return m > 0 ? 1 / std::sqrt(m) : 1.0; });
  const auto motions =
      decompose_symmetric<dynamic>(scale.asDiagonal() * equations.motion * scale.asDiagonal());
  // What moves the points by less than rounding does, such as turning a line about itself.
  constexpr double negligible = 1e-10;
  const double largest = std::max(u > 0 ? motions.values[u - 1] : 0.0, 0.0);
  index_t still = 0;
  while (still < u && motions.values[still] <= negligible * largest) ++still;

  normal_solution solution{.step = Eigen::VectorXd::Zero(u),
                           .directions = Eigen::MatrixXd(u, u),
                           .eigenvalues = Eigen::VectorXd::Zero(u),
                           .undetermined = still};
  solution.directions.leftCols(still) =
      (scale.asDiagonal() * motions.vectors.leftCols(still)).colwise().normalized();
  if (still == u) return solution;

  // In these coordinates, a step of length 1 moves the points by 1.
  const Eigen::MatrixXd unit =
      scale.asDiagonal() * motions.vectors.rightCols(u - still) *
      motions.values.tail(u - still).cwiseSqrt().cwiseInverse().asDiagonal();
  const auto seen = decompose_symmetric<dynamic>(unit.transpose() * equations.information * unit);
  solution.directions.rightCols(u - still) = unit * seen.vectors;
  solution.eigenvalues.tail(u - still) = seen.values;
  while (solution.undetermined < u &&
         !(solution.eigenvalues[solution.undetermined] >= min_eigenvalue))
    ++solution.undetermined;
  for (index_t k = solution.undetermined; k < u; ++k) {
    const auto direction = solution.directions.col(k);
    solution.step -= direction * (direction.dot(equations.gradient) / solution.eigenvalues[k]);
  }
  return solution;
}

}  // namespace cilantro
