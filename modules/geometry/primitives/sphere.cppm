// SPDX-License-Identifier: MIT
export module cilantro.geometry:sphere;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// The points at a distance of `radius` from `center`: a circle in 2D. In double, whatever the
/// points are in.
export template <int D>
struct sphere_model {
  Eigen::Matrix<double, D, 1> center;
  double radius = 0;

  /// Positive outside. In the units of the points.
  template <class V>
  [[nodiscard]] double signed_distance(const Eigen::MatrixBase<V>& point) const {
    return (in_double<D>(point, center.size()) - center).norm() - radius;
  }
};

}  // namespace cilantro
