// SPDX-License-Identifier: MIT
export module cilantro.geometry:cylinder;

import cilantro.standard;
import cilantro.core;
import :line;

namespace cilantro {

/// An infinite cylinder: the points at a distance of `radius` from an `axis` in 3D. Always in
/// double.
export struct cylinder_model {
  line_model<3> axis;
  double radius = 0;

  /// The distance to the surface in the units of the points: positive outside, negative inside.
  template <class V>
  [[nodiscard]] double signed_distance(const Eigen::MatrixBase<V>& point) const {
    return axis.distance(point) - radius;
  }
};

}  // namespace cilantro
