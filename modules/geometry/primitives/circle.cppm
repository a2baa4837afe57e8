// SPDX-License-Identifier: MIT
export module cilantro.geometry:circle;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// A circle in 3D, always in double. (In 2D, a circle is a `sphere_model<2>`.)
export struct circle_model {
  Eigen::Vector3d center;  ///< In the units of the points.
  /// The normal of its plane: unit length; its entry of largest magnitude is positive.
  Eigen::Vector3d normal;
  double radius = 0;  ///< In the units of the points.

  /// The distance to the circle itself, not to the disk, in the units of the points.
  template <class V>
  [[nodiscard]] double distance(const Eigen::MatrixBase<V>& point) const {
    const Eigen::Vector3d from = in_double<3>(point, 3) - center;
    const double above = normal.dot(from);
    const double outside = (from - above * normal).norm() - radius;
    return std::sqrt(above * above + outside * outside);
  }
};

}  // namespace cilantro
