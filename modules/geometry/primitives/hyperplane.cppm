// SPDX-License-Identifier: MIT
export module cilantro.geometry:hyperplane;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// The points x with normal · x + offset = 0: a plane in 3D, a line in 2D. Always in double, since
/// an offset far from the origin would lose most of its digits in float.
export template <int D>
struct hyperplane_model {
  Eigen::Matrix<double, D, 1> normal;  ///< Unit length; its entry of largest magnitude is positive.
  double offset = 0;                   ///< In the units of the points.

  /// The distance in the units of the points: positive on the side to which the normal points.
  template <class V>
  [[nodiscard]] double signed_distance(const Eigen::MatrixBase<V>& point) const {
    return normal.dot(in_double<D>(point, normal.size())) + offset;
  }
  /// The nearest point of the plane.
  template <class V>
  [[nodiscard]] Eigen::Matrix<double, D, 1> project(const Eigen::MatrixBase<V>& point) const {
    return in_double<D>(point, normal.size()) - signed_distance(point) * normal;
  }
};

}  // namespace cilantro
