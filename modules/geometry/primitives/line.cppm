// SPDX-License-Identifier: MIT
export module cilantro.geometry:line;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// The points `point` + t · `direction`. In double, whatever the points are in.
export template <int D>
struct line_model {
  using vector = Eigen::Matrix<double, D, 1>;
  vector point;      ///< One of the line.
  vector direction;  ///< Unit length; its entry of largest magnitude is positive.

  /// In the units of the points.
  template <class V>
  [[nodiscard]] double distance(const Eigen::MatrixBase<V>& other) const {
    const vector from = in_double<D>(other, point.size()) - point;
    return (from - direction.dot(from) * direction).norm();
  }
};

}  // namespace cilantro
