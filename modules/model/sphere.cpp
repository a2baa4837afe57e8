// SPDX-License-Identifier: MIT
module;
#include <cmath>
#include <optional>
module cilantro.model;

namespace cilantro {
namespace {

/// Least squares of the distances, from a sphere that is near it.
sphere_model<dynamic> refine(const Eigen::MatrixXd& points, sphere_model<dynamic> model) {
  const index_t d = points.rows();
  for (int step = 0; step < 20; ++step) {
    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(d + 1, d + 1);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(d + 1), row(d + 1);
    for (const auto& p : points.colwise()) {
      const Eigen::VectorXd out = p - model.center;
      const double distance = out.norm();
      if (!(distance > 0)) continue;
      row << -out / distance, -1;
      information += row * row.transpose();
      gradient += row * (distance - model.radius);
    }
    const Eigen::VectorXd change = solve_symmetric(information, -gradient);
    if (!change.allFinite()) break;
    model.center += change.head(d);
    model.radius += change[d];
    if (change.norm() <= 1e-12 * std::abs(model.radius)) break;
  }
  return model;
}

}  // namespace

std::optional<sphere_model<dynamic>> fit_sphere(const std::optional<gathered_points>& data,
                                                double negligible, const sphere_limits& limits) {
  if (!data) return std::nullopt;
  const index_t d = data->points.rows(), n = data->points.cols();
  if (d < 1 || n < d + 1) return std::nullopt;
  // |p|² = 2 c·p + (r² − |c|²), linear in c and the last term; around the mean and scaled, so that
  // the columns compare.
  const Eigen::VectorXd mean = data->points.rowwise().mean();
  Eigen::MatrixXd points = data->points.colwise() - mean;
  const double scale = std::sqrt(points.squaredNorm() / double(n));
  if (!(scale > 0)) return std::nullopt;
  points /= scale;
  Eigen::MatrixXd system(n, d + 1);
  system << 2 * points.transpose(), Eigen::VectorXd::Ones(n);
  const auto solution =
      solve_least_squares(system, points.colwise().squaredNorm().transpose(), negligible);
  if (solution.rank <= d) return std::nullopt;
  const Eigen::VectorXd unknowns = solution.unknowns;
  sphere_model<dynamic> model{unknowns.head(d),
                              std::sqrt(unknowns[d] + unknowns.head(d).squaredNorm())};
  if (n > d + 1) model = refine(points, model);
  model = {data->origin + mean + scale * model.center, scale * model.radius};
  if (!std::isfinite(model.radius) || !(model.radius > 0) || !model.center.allFinite() ||
      !allows(limits.radius, model.radius))
    return std::nullopt;
  return model;
}

}  // namespace cilantro
