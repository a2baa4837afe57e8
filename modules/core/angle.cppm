// SPDX-License-Identifier: MIT
export module cilantro.core:angle;

import cilantro.standard;
import cilantro.eigen;
import :error;

namespace cilantro {

/// Throws `invalid_input` unless `angle`, in radians, can lie between two directions: from 0 to π,
/// with a little room for rounding. Larger values are probably degrees.
export inline void expect_angle(double angle, const char* what) {
  if (!(angle >= 0 && angle <= 3.1416))
    throw invalid_input{std::string{what} + " must be in radians, from 0 to pi, and is " +
                        in_digits(angle)};
}

/// The angle between two vectors of any length and dimension, in radians, in [0, π]. Exactly 0
/// between a vector and itself, and accurate for small angles, where an arc cosine is not. NaN for
/// a zero vector. Throws `invalid_input` for vectors of different dimension.
/// Source: Kahan 2006, "How futile are mindless assessments of roundoff", section 12.
export template <class A, class B>
[[nodiscard]] typename A::Scalar angle_between(const Eigen::MatrixBase<A>& a,
                                               const Eigen::MatrixBase<B>& b) {
  expects(a.size() == b.size(), "angle_between: the vectors must have the same dimension");
  using S = typename A::Scalar;
  const S length_a = a.norm(), length_b = b.norm();
  if (!(length_a > 0 && length_b > 0)) return std::numeric_limits<S>::quiet_NaN();
  const auto difference = (a / length_a - b / length_b).norm();
  return 2 * std::atan2(difference, (a / length_a + b / length_b).norm());
}

}  // namespace cilantro
