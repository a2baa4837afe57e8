// SPDX-License-Identifier: MIT
export module cilantro.model:circle;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :data;
import :limits;

namespace cilantro {

/// A circle in 3D. In double, whatever the points are in. (In 2D, a circle is a `sphere_model<2>`.)
export struct circle_model {
  Eigen::Vector3d center;
  Eigen::Vector3d normal;  ///< Of its plane: unit length, its entry of largest magnitude positive.
  double radius = 0;

  /// To the circle itself, not to the disk. In the units of the points.
  template <class V>
  [[nodiscard]] double distance(const Eigen::MatrixBase<V>& point) const {
    const Eigen::Vector3d from = point.template cast<double>() - center;
    const double above = normal.dot(from);
    const double outside = (from - above * normal).norm() - radius;
    return std::sqrt(above * above + outside * outside);
  }
};

export struct circle_limits {
  std::optional<direction_limit> normal = {};
  radius_limit radius = {};
};

[[nodiscard]] std::optional<circle_model> fit_circle(const std::optional<gathered_points>& data,
                                                     double negligible,
                                                     const circle_limits& limits);

/// Circles through points in 3D: three points are a sample, degenerate if they lie on a line. More
/// are fitted by the plane of least squares, and within it as `sphere_family` does. Views the
/// points, which must outlive it.
export template <Scalar S>
class circle_family {
 public:
  using model_type = circle_model;

  /// Throws `invalid_input` for limits that make no sense.
  template <BorrowedData P>
    requires(data_view_of<P>::static_dimension == 3)
  explicit circle_family(P&& points, circle_limits limits = {})
      : points_{data_in(std::forward<P>(points))}, limits_{std::move(limits)} {
    expect_sensible(limits_.normal, 3);
    expect_sensible(limits_.radius);
  }

  [[nodiscard]] index_t size() const { return points_.size(); }
  [[nodiscard]] index_t sample_size() const { return 3; }
  [[nodiscard]] std::optional<model_type> fit(std::span<const index_t> indices) const {
    return fit_circle(gather_points<S, 3>(points_, indices), negligible_ratio<S>, limits_);
  }
  [[nodiscard]] double residual(const model_type& model, index_t i) const {
    return model.distance(points_[i]);
  }

 private:
  points_view<S, 3> points_;
  circle_limits limits_;
};
export template <BorrowedData P>
circle_family(P&&, circle_limits = {}) -> circle_family<typename data_view_of<P>::scalar>;

}  // namespace cilantro
