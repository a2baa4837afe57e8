// SPDX-License-Identifier: MIT
export module cilantro.geometry:cylinder;

import cilantro.standard;
import cilantro.core;
import :line;

namespace cilantro {

/// The points at a distance of `radius` from an axis in 3D, without ends. In double, whatever the
/// points are in.
export struct cylinder_model {
  line_model<3> axis;
  double radius = 0;

  /// Positive outside. In the units of the points.
  template <class V>
  [[nodiscard]] double signed_distance(const Eigen::MatrixBase<V>& point) const {
    return axis.distance(point) - radius;
  }
};

}  // namespace cilantro
