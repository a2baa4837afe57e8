// SPDX-License-Identifier: MIT
module cilantro.consensus;

import :refinement;

namespace cilantro {
namespace {

descended<sphere_model<dynamic>> descend_from(const Eigen::MatrixXd& points,
                                              const sphere_model<dynamic>& start) {
  const index_t d = points.rows();
  return descend(
      start,
      [&](const sphere_model<dynamic>& model) {
        squared_residuals all{d + 1};
        Eigen::VectorXd row(d + 1);
        for (const auto& p : points.colwise()) {
          const Eigen::VectorXd out = p - model.center;
          const double distance = out.norm();
          row << -out / (distance > 0 ? distance : 1), -1;
          all.add(distance - model.radius, row);
        }
        return all;
      },
      [&](const sphere_model<dynamic>& model, const Eigen::VectorXd& step) {
        return sphere_model<dynamic>{model.center + step.head(d), model.radius + step[d]};
      });
}

/// Least squares of the distances. Of points around 0 whose distance from it has a root mean square
/// of 1, from a sphere that is near them.
sphere_model<dynamic> refine(const Eigen::MatrixXd& points, const sphere_model<dynamic>& start) {
  auto best = descend_from(points, start);
  constexpr double noisy = 0.03;
  if (best.sum <= noisy * noisy * double(points.cols())) return best.model;
  // A cap that is as thick as it is high looks much the same from the other side, and from afar.
  const Eigen::VectorXd across =
      decompose_symmetric<dynamic>(points * points.transpose()).vectors.col(0);
  for (const double distance : {0.5, 1.0, 2.0, 4.0, 8.0})
    for (const double side : {-1.0, 1.0}) {
      const Eigen::VectorXd center = side * distance * across;
      const double radius = (points.colwise() - center).colwise().norm().mean();
      auto other = descend_from(points, {center, radius});
      if (other.sum < best.sum) best = std::move(other);
    }
  return best.model;
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
