// SPDX-License-Identifier: MIT
export module cilantro.geometry:sphere;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// The points at a distance of `radius` from `center`; in 2D, a circle. Always in double.
export template <int D>
struct sphere_model {
  Eigen::Matrix<double, D, 1> center;
  double radius = 0;

  /// The distance to the surface in the units of the points: positive outside, negative inside.
  template <class V>
  [[nodiscard]] double signed_distance(const Eigen::MatrixBase<V>& point) const {
    return (in_double<D>(point, center.size()) - center).norm() - radius;
  }
};

}  // namespace cilantro
