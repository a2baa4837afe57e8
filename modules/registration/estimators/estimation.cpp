// SPDX-License-Identifier: MIT
module cilantro.registration;

namespace cilantro {

prepared_equations prepare_equations(const pair_totals& totals, const Eigen::VectorXd& place,
                                     const Eigen::MatrixXd& spread,
                                     const Eigen::MatrixXd& lower_information,
                                     const Eigen::VectorXd& gradient,
                                     const velocity_field& velocities) {
  const double total = totals.weight > 0 ? totals.weight : 1;
  prepared_equations prepared{.information = lower_information, .mean = place / total};
  prepared.information.triangularView<Eigen::Upper>() = lower_information.transpose();
  const Eigen::MatrixXd covariance = spread / total - prepared.mean * prepared.mean.transpose();
  const double seen = totals.seen > 0 ? totals.seen : 1;
  prepared.equations = {prepared.information / seen, gradient / seen,
                        velocities.mean_square(prepared.mean, covariance)};
  // Without weights there is no motion that anybody sees.
  if (!(totals.weight > 0)) prepared.equations.motion.setZero();
  return prepared;
}

alignment_fit fit_of(const pair_totals& totals, const prepared_equations& prepared,
                     const normal_solution& solution, const velocity_field& velocities,
                     const Eigen::VectorXd& center) {
  const auto share = [](double part, double whole) { return whole > 0 ? part / whole : 0.0; };
  alignment_fit fit;
  fit.pairs = totals.pairs;
  fit.rmse = std::sqrt(share(totals.squared_distance, double(totals.pairs)));
  fit.residual = std::sqrt(share(totals.squared_residual, totals.weight));
  const Eigen::MatrixXd to_center = velocities.recentering(center);
  fit.information = to_center.transpose() * prepared.information * to_center;
  fit.directions = velocities.recentering(-center) * solution.directions;
  // Shares, but for rounding and rows that are not orthogonal.
  fit.eigenvalues = solution.eigenvalues.cwiseMin(1);
  fit.unknowns = solution.step.size();
  fit.undetermined = solution.undetermined;
  return fit;
}

moved_map move_map(const motion_step& move, const Eigen::MatrixXd& linear,
                   const Eigen::VectorXd& translation, const Eigen::VectorXd& center,
                   const Eigen::VectorXd& mean) {
  return {{move.linear * linear, center + move.linear * (translation - center) + move.translation},
          {rotation_angle(move.linear), (move.linear * mean + move.translation - mean).norm()}};
}

}  // namespace cilantro
