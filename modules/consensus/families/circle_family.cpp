// SPDX-License-Identifier: MIT
module cilantro.consensus;

namespace cilantro {

template <Scalar S>
std::optional<circle_model> fit_circle(points_view<S, 3> points,
                                       std::span<const std::int32_t> indices,
                                       const circle_limits& limits) {
  const auto plane = fit_hyperplane(points, indices, {limits.normal});
  const auto data = gather_points(points, indices);
  if (!plane || !data) return std::nullopt;
  const Eigen::Vector3d normal = plane->normal;
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = normal.unitOrthogonal();
  basis.col(1) = normal.cross(basis.col(0));
  const gathered_points within{basis.transpose() * data->points, Eigen::VectorXd::Zero(2)};
  const auto found = fit_sphere(within, negligible_ratio<S>, {limits.radius});
  if (!found) return std::nullopt;
  const Eigen::Vector3d center = data->origin + basis * found->center;
  return circle_model{plane->project(center), normal, found->radius};
}
template std::optional<circle_model> fit_circle(points_view<float, 3>,
                                                std::span<const std::int32_t>,
                                                const circle_limits&);
template std::optional<circle_model> fit_circle(points_view<double, 3>,
                                                std::span<const std::int32_t>,
                                                const circle_limits&);

}  // namespace cilantro
