// SPDX-License-Identifier: MIT
module;
#include <cmath>
#include <optional>
module cilantro.model;

namespace cilantro {
namespace {

/// Sine of the angle between two normals below which they are parallel.
constexpr double parallel = 1e-3;

std::optional<cylinder_model> checked(Eigen::Vector3d through, Eigen::Vector3d axis, double radius,
                                      const cylinder_limits& limits) {
  if (!std::isfinite(radius) || !(radius > 0) || !through.allFinite() || !axis.allFinite() ||
      !allows(limits.radius, radius) || !allows(limits.axis, axis))
    return std::nullopt;
  index_t largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  if (axis[largest] < 0) axis = -axis;
  return cylinder_model{{through, axis}, radius};
}

}  // namespace

std::optional<cylinder_model> cylinder_of(const Eigen::Vector3d& p, const Eigen::Vector3d& p_normal,
                                          const Eigen::Vector3d& q, const Eigen::Vector3d& q_normal,
                                          const cylinder_limits& limits) {
  Eigen::Vector3d axis = p_normal.cross(q_normal);
  const double sine = axis.norm() / (p_normal.norm() * q_normal.norm());
  if (!(sine > parallel)) return std::nullopt;
  axis.normalize();
  // Across the axis, the lines along both normals meet in the centre.
  const Eigen::Vector3d between = q - p;
  const double along = between.cross(q_normal).dot(axis) / p_normal.cross(q_normal).dot(axis);
  const Eigen::Vector3d center = p + along * p_normal;
  const line_model<3> through{center, axis};
  return checked(center, axis, (through.distance(p) + through.distance(q)) / 2, limits);
}

std::optional<cylinder_model> refine_cylinder(const gathered_points& data,
                                              const cylinder_model& start,
                                              const cylinder_limits& limits) {
  const Eigen::Vector3d origin = data.origin;
  // The point of the axis that is nearest to the data, so that tilting it moves them little.
  const Eigen::Vector3d mean = data.points.rowwise().mean();
  Eigen::Vector3d axis = start.axis.direction;
  Eigen::Vector3d center = start.axis.point - origin;
  center += axis.dot(mean - center) * axis;
  double radius = start.radius;
  for (int step = 0; step < 30; ++step) {
    const Eigen::Vector3d u = axis.unitOrthogonal(), v = axis.cross(u);
    Eigen::Matrix<double, 5, 5> information = Eigen::Matrix<double, 5, 5>::Zero();
    Eigen::Matrix<double, 5, 1> gradient = Eigen::Matrix<double, 5, 1>::Zero(), row;
    for (index_t i = 0; i < data.points.cols(); ++i) {
      const Eigen::Vector3d from = data.points.col(i) - center;
      const double height = axis.dot(from);
      const Eigen::Vector3d out = from - height * axis;
      const double distance = out.norm();
      if (!(distance > 0)) continue;
      const double along_u = out.dot(u) / distance, along_v = out.dot(v) / distance;
      // By the place of the axis along u and v, its tilt towards them, and the radius.
      row << -along_u, -along_v, -height * along_u, -height * along_v, -1;
      information += row * row.transpose();
      gradient += row * (distance - radius);
    }
    const Eigen::Matrix<double, 5, 1> change = solve_symmetric(information, -gradient);
    if (!change.allFinite()) return std::nullopt;
    center += change[0] * u + change[1] * v;
    axis = (axis + change[2] * u + change[3] * v).normalized();
    radius += change[4];
    if (change.norm() <= 1e-12 * std::abs(radius)) break;
  }
  return checked(origin + center, axis, radius, limits);
}

}  // namespace cilantro
