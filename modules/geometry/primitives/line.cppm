// SPDX-License-Identifier: MIT
export module cilantro.geometry:line;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// A line: the points `point` + t · `direction`. Always in double.
export template <int D>
struct line_model {
  using vector = Eigen::Matrix<double, D, 1>;
  vector point;      ///< A point of the line.
  vector direction;  ///< Unit length; its entry of largest magnitude is positive.

  /// The distance in the units of the points.
  template <class V>
  [[nodiscard]] double distance(const Eigen::MatrixBase<V>& other) const {
    const vector from = in_double<D>(other, point.size()) - point;
    return (from - direction.dot(from) * direction).norm();
  }
};

}  // namespace cilantro
