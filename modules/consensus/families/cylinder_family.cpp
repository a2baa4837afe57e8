// SPDX-License-Identifier: MIT
module cilantro.consensus;

import :refinement;

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

namespace {

/// Least squares of the distances to `points`, by the place of the axis along u and v, its tilt
/// towards them, and the radius.
descended<cylinder_model> descend_from(const Eigen::MatrixXd& points, cylinder_model start) {
  // The point of the axis that is nearest to the data, so that tilting it moves them little.
  const Eigen::Vector3d mean = points.rowwise().mean();
  start.axis.point += start.axis.direction.dot(mean - start.axis.point) * start.axis.direction;
  return descend(
      start,
      [&](const cylinder_model& model) {
        const Eigen::Vector3d& axis = model.axis.direction;
        const Eigen::Vector3d u = axis.unitOrthogonal(), v = axis.cross(u);
        squared_residuals all{5};
        Eigen::VectorXd row(5);
        for (const auto& p : points.colwise()) {
          const Eigen::Vector3d from = p - model.axis.point;
          const double height = axis.dot(from);
          const Eigen::Vector3d out = from - height * axis;
          const double distance = out.norm(), divisor = distance > 0 ? distance : 1;
          const double along_u = out.dot(u) / divisor, along_v = out.dot(v) / divisor;
          row << -along_u, -along_v, -height * along_u, -height * along_v, -1;
          all.add(distance - model.radius, row);
        }
        return all;
      },
      [](const cylinder_model& model, const Eigen::VectorXd& step) {
        const Eigen::Vector3d& axis = model.axis.direction;
        const Eigen::Vector3d u = axis.unitOrthogonal(), v = axis.cross(u);
        return cylinder_model{{model.axis.point + step[0] * u + step[1] * v,
                               (axis + step[2] * u + step[3] * v).normalized()},
                              model.radius + step[4]};
      });
}

/// Along the direction in which the normals vary least, around the circle that the points make
/// across it.
std::optional<cylinder_model> cylinder_across(const Eigen::MatrixXd& normals,
                                              const Eigen::MatrixXd& points) {
  const Eigen::MatrixXd scatter = normals * normals.transpose();
  if (!scatter.allFinite()) return std::nullopt;
  const Eigen::Vector3d axis = decompose_symmetric<dynamic>(scatter).vectors.col(0);
  Eigen::Matrix<double, 3, 2> across;
  across.col(0) = axis.unitOrthogonal();
  across.col(1) = axis.cross(across.col(0));
  const gathered_points flat{across.transpose() * points, Eigen::VectorXd::Zero(2)};
  const auto circle = fit_sphere(flat, negligible_ratio<double>, {});
  if (!circle) return std::nullopt;
  return cylinder_model{{across * circle->center, axis}, circle->radius};
}

}  // namespace

std::optional<cylinder_model> refine_cylinder(const gathered_points& data,
                                              const Eigen::MatrixXd& normals,
                                              const cylinder_model& start,
                                              const cylinder_limits& limits) {
  cylinder_model near = start;
  near.axis.point -= data.origin;
  const auto allowed = [&](const descended<cylinder_model>& found) {
    const auto& [axis, radius] = found.model;
    return checked(data.origin + axis.point, axis.direction, radius, limits);
  };
  const auto first = descend_from(data.points, near);
  // The normals of two points may be those that deviate most.
  if (const auto other_start = cylinder_across(normals, data.points)) {
    const auto other = descend_from(data.points, *other_start);
    if (const auto better = allowed(other); better && (other.sum < first.sum || !allowed(first)))
      return better;
  }
  return allowed(first);
}

}  // namespace cilantro
