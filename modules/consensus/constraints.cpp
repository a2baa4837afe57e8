// SPDX-License-Identifier: MIT
module cilantro.consensus;

namespace cilantro {

void expect_sensible(const std::optional<direction_limit>& limit, index_t dimension) {
  if (!limit) return;
  const auto axis =
      limit->axis.as<double, dynamic>(dimension, "the axis must have the dimension of the points");
  expects(axis.allFinite() && axis.norm() > 0, "the axis must be finite and not zero");
  expect_angle(limit->max_angle, "direction_limit: the angle to the axis");
}

void expect_sensible(const radius_limit& limit) {
  expects(0 <= limit.min && limit.min <= limit.max,
          "radius_limit: min must not be negative, and not above max");
}

bool allows(const std::optional<direction_limit>& limit, const Eigen::VectorXd& direction) {
  if (!limit) return true;
  const auto axis = limit->axis.as<double, dynamic>(direction.size(), "");
  return std::min(angle_between(axis, direction),
                  angle_between(axis, Eigen::VectorXd{-direction})) <= limit->max_angle;
}

}  // namespace cilantro
