// SPDX-License-Identifier: MIT
export module cilantro.consensus:constraints;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// Allows only directions at most `max_angle` radians away from `axis` or its opposite.
export struct direction_limit {
  coordinates axis;
  double max_angle;
};

/// Allows only radii from `min` to `max`, inclusive, in the units of the points.
export struct radius_limit {
  double min = 0;
  double max = std::numeric_limits<double>::infinity();
};

/// Throws `invalid_input` for an axis that is zero, not finite or of another dimension, and for an
/// angle that is not from 0 to π.
void expect_sensible(const std::optional<direction_limit>& limit, index_t dimension);
/// Throws `invalid_input` for a range that is empty or below 0.
void expect_sensible(const radius_limit& limit);

[[nodiscard]] bool allows(const std::optional<direction_limit>& limit,
                          const Eigen::VectorXd& direction);
[[nodiscard]] inline bool allows(const radius_limit& limit, double radius) {
  return limit.min <= radius && radius <= limit.max;
}

}  // namespace cilantro
