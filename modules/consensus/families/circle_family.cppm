// SPDX-License-Identifier: MIT
export module cilantro.consensus:circle_family;

import cilantro.standard;
import cilantro.core;
import cilantro.geometry;
import :sample;
import :constraints;

namespace cilantro {

/// Which circles are allowed: the `normal` of their plane, and their `radius`.
export struct circle_limits {
  std::optional<direction_limit> normal = {};
  radius_limit radius = {};
};

template <Scalar S>
std::optional<circle_model> fit_circle(points_view<S, 3> points,
                                       std::span<const std::int32_t> indices,
                                       const circle_limits& limits);

/// Circles through points in 3D. A sample is three points, degenerate if they lie on a line. More
/// points are fitted by a least-squares plane, and within it as `sphere_family` does. Views the
/// points, which must outlive it.
export template <Scalar S>
class circle_family {
 public:
  using model_type = circle_model;

  /// Throws `invalid_input` for limits that make no sense.
  template <BorrowedPoints P>
    requires(dimension_of<P> == 3)
  explicit circle_family(P&& points, circle_limits limits = {})
      : points_{as_points(std::forward<P>(points))}, limits_{std::move(limits)} {
    expect_sensible(limits_.normal, 3);
    expect_sensible(limits_.radius);
  }

  [[nodiscard]] index_t size() const { return points_.size(); }
  [[nodiscard]] index_t sample_size() const { return 3; }
  [[nodiscard]] std::optional<model_type> fit(std::span<const std::int32_t> indices) const {
    return fit_circle(points_, indices, limits_);
  }
  [[nodiscard]] double residual(const model_type& model, index_t i) const {
    return model.distance(points_[i]);
  }

 private:
  points_view<S, 3> points_;
  circle_limits limits_;
};
export template <BorrowedPoints P>
circle_family(P&&, circle_limits = {}) -> circle_family<scalar_of<P>>;

}  // namespace cilantro
