// SPDX-License-Identifier: MIT
module;
#include <optional>
module cilantro.model;

namespace cilantro {

std::optional<circle_model> fit_circle(const std::optional<gathered_points>& data,
                                       double negligible, const circle_limits& limits) {
  const auto plane = fit_hyperplane(data, negligible, {limits.normal});
  if (!plane) return std::nullopt;
  const Eigen::Vector3d normal = plane->normal;
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = normal.unitOrthogonal();
  basis.col(1) = normal.cross(basis.col(0));
  const gathered_points within{basis.transpose() * data->points, Eigen::VectorXd::Zero(2)};
  const auto found = fit_sphere(within, negligible, {limits.radius});
  if (!found) return std::nullopt;
  const Eigen::Vector3d center = data->origin + basis * found->center;
  return circle_model{plane->project(center), normal, found->radius};
}

}  // namespace cilantro
