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
    const Eigen::Vector3d from = in_double<3>(point, 3) - center;
    const double above = normal.dot(from);
    const double outside = (from - above * normal).norm() - radius;
    return std::sqrt(above * above + outside * outside);
  }
};

export struct circle_limits {
  std::optional<direction_limit> normal = {};
  radius_limit radius = {};
};

template <Scalar S>
std::optional<circle_model> fit_circle(points_view<S, 3> points, std::span<const index_t> indices,
                                       const circle_limits& limits);

/// Circles through points in 3D: three points are a sample, degenerate if they lie on a line. More
/// are fitted by the plane of least squares, and within it as `sphere_family` does. Views the
/// points, which must outlive it.
export template <Scalar S>
class circle_family {
 public:
  using model_type = circle_model;

  /// Throws `invalid_input` for limits that make no sense.
  template <BorrowedPlaces P>
    requires(places_view_of<P>::static_dimension == 3)
  explicit circle_family(P&& points, circle_limits limits = {})
      : points_{as_places(std::forward<P>(points))}, limits_{std::move(limits)} {
    expect_sensible(limits_.normal, 3);
    expect_sensible(limits_.radius);
  }

  [[nodiscard]] index_t size() const { return points_.size(); }
  [[nodiscard]] index_t sample_size() const { return 3; }
  [[nodiscard]] std::optional<model_type> fit(std::span<const index_t> indices) const {
    return fit_circle(points_, indices, limits_);
  }
  [[nodiscard]] double residual(const model_type& model, index_t i) const {
    return model.distance(points_[i]);
  }

 private:
  points_view<S, 3> points_;
  circle_limits limits_;
};
export template <BorrowedPlaces P>
circle_family(P&&, circle_limits = {}) -> circle_family<typename places_view_of<P>::scalar>;

}  // namespace cilantro
