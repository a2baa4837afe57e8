// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
module cilantro.registration;

namespace cilantro {
namespace {

/// Relative to the largest one, singular values below this are rounding.
constexpr double negligible = 1e-10;

/// The best motion, and what takes the place of the covariance in the curvature of the cost.
struct best_motion {
  motion_step move;
  Eigen::MatrixXd curvature;
};

best_motion match(const rigid_motion&, const Eigen::VectorXd& source_mean,
                  const Eigen::VectorXd& target_mean, const Eigen::MatrixXd&,
                  const Eigen::MatrixXd& cross) {
  // Planes that the pairs say nothing about turn as little as possible.
  const Eigen::MatrixXd turn = nearest_rotation(cross);
  const Eigen::MatrixXd product = turn.transpose() * cross;
  return {{turn, target_mean - turn * source_mean}, (product + product.transpose()) / 2};
}

best_motion match(const affine_motion&, const Eigen::VectorXd& source_mean,
                  const Eigen::VectorXd& target_mean, const Eigen::MatrixXd& covariance,
                  const Eigen::MatrixXd& cross) {
  const index_t d = cross.rows();
  const auto axes = decompose_symmetric(covariance);
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(d, d);
  for (index_t k = 0; k < d; ++k)
    if (axes.values[k] > negligible * axes.values[d - 1])
      inverse += axes.vectors.col(k) * axes.vectors.col(k).transpose() / axes.values[k];
  // Across the subspace in which the points lie, nothing is known and nothing changed.
  const Eigen::MatrixXd linear = Eigen::MatrixXd::Identity(d, d) + (cross - covariance) * inverse;
  return {{linear, target_mean - linear * source_mean}, covariance};
}

}  // namespace

template <class Model>
matched_motion solve_matches(const Model& model, const pair_totals& totals,
                             const Eigen::VectorXd& place, const Eigen::MatrixXd& spread,
                             const Eigen::VectorXd& target, const Eigen::MatrixXd& product,
                             const velocity_field& velocities) {
  const double total = totals.weight > 0 ? totals.weight : 1;
  const Eigen::VectorXd mean = place / total, target_mean = target / total;
  const Eigen::MatrixXd covariance = spread / total - mean * mean.transpose();
  const auto [move, curvature] =
      match(model, mean, target_mean, covariance, product / total - target_mean * mean.transpose());
  const Eigen::MatrixXd information = totals.weight * velocities.mean_square(mean, covariance);
  matched_motion matched{move,
                         prepare_equations(totals, place, spread, information,
                                           Eigen::VectorXd::Zero(information.rows()), velocities)};
  // How well a direction is determined, the cost tells: of a sphere, JᵀJ sees rotations.
  matched.prepared.equations.information = velocities.mean_square(mean, curvature);
  return matched;
}
template matched_motion solve_matches(const rigid_motion&, const pair_totals&,
                                      const Eigen::VectorXd&, const Eigen::MatrixXd&,
                                      const Eigen::VectorXd&, const Eigen::MatrixXd&,
                                      const velocity_field&);
template matched_motion solve_matches(const affine_motion&, const pair_totals&,
                                      const Eigen::VectorXd&, const Eigen::MatrixXd&,
                                      const Eigen::VectorXd&, const Eigen::MatrixXd&,
                                      const velocity_field&);

#define CILANTRO_INSTANTIATE(S, D)                                      \
  template match_sums<D> sum_matches<S, D, unit_weight>(                \
      const registered_surfaces<S, D>&, const affine_parts<double, D>&, \
      std::span<const correspondence<S>>, const unit_weight&, const execution&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
