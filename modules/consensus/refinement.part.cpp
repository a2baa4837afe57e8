// SPDX-License-Identifier: MIT
//
// Least squares of distances that are no linear function of a model, from one that is near.
module cilantro.consensus:refinement;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// Some residuals at a model: Σ r², and Gauss–Newton's equations for a change of it.
struct squared_residuals {
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
  double sum = 0;

  explicit squared_residuals(index_t unknowns)
      : information{Eigen::MatrixXd::Zero(unknowns, unknowns)},
        gradient{Eigen::VectorXd::Zero(unknowns)} {}
  void add(double residual, const Eigen::VectorXd& row) {
    information += row * row.transpose();
    gradient += row * residual;
    sum += residual * residual;
  }
};

template <class Model>
struct descended {
  Model model;
  double sum;  ///< Of its squared residuals.
};

/// The model to which `start` descends: never worse than it. `look_at(model)` gives its
/// `squared_residuals`, `change(model, step)` another model.
/// Source: Marquardt 1963, "An algorithm for least-squares estimation of nonlinear parameters".
template <class Model, class LookAt, class Change>
[[nodiscard]] descended<Model> descend(Model start, LookAt&& look_at, Change&& change) {
  squared_residuals here = look_at(start);
  double damping = 1e-6;
  for (int trial = 0; trial < 200 && damping < 1e12 && here.sum > 0; ++trial) {
    Eigen::MatrixXd damped = here.information;
    damped.diagonal() *= 1 + damping;
    const Eigen::VectorXd step = solve_symmetric(damped, -here.gradient);
    if (!step.allFinite()) {
      damping *= 10;
      continue;
    }
    Model next = change(start, step);
    squared_residuals there = look_at(next);
    if (!(there.sum < here.sum)) {
      damping *= 10;
      continue;
    }
    const bool is_at_rest = here.sum - there.sum <= 1e-15 * here.sum;
    start = std::move(next);
    here = std::move(there);
    if (is_at_rest) break;
    damping /= 10;
  }
  return {std::move(start), here.sum};
}

}  // namespace cilantro
