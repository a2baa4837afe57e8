// SPDX-License-Identifier: MIT
export module cilantro.consensus:sphere_family;

import cilantro.standard;
import cilantro.core;
import cilantro.geometry;
import :sample;
import :constraints;

namespace cilantro {

/// Which spheres are allowed: their `radius`.
export struct sphere_limits {
  radius_limit radius = {};
};

/// The sphere through the data if there are Dim + 1, otherwise the least-squares one. Nothing if
/// they lie in a hyperplane.
[[nodiscard]] std::optional<sphere_model<dynamic>> fit_sphere(
    const std::optional<gathered_points>& data, double negligible, const sphere_limits& limits);

/// Spheres through points of any dimension; in 2D, circles. A sample is Dim + 1 points, degenerate
/// if they lie in a hyperplane. More points are fitted by least squares of the distances to the
/// sphere. Views the points, which must outlive it.
/// Source: Kåsa 1976 for the start; Gander, Golub & Strebel 1994, "Least-squares fitting of circles
/// and ellipses", section 4, for the iteration.
export template <Scalar S, int D>
class sphere_family {
 public:
  using model_type = sphere_model<D>;

  /// Throws `invalid_input` for limits that make no sense.
  template <BorrowedPoints P>
  explicit sphere_family(P&& points, sphere_limits limits = {})
      : points_{as_points(std::forward<P>(points))}, limits_{limits} {
    expect_sensible(limits_.radius);
  }

  [[nodiscard]] index_t size() const { return points_.size(); }
  [[nodiscard]] index_t sample_size() const { return points_.dimension() + 1; }
  [[nodiscard]] std::optional<model_type> fit(std::span<const std::int32_t> indices) const {
    const auto found = fit_sphere(gather_points<S, closed_dimension<D>>(points_, indices),
                                  negligible_ratio<S>, limits_);
    if (!found) return std::nullopt;
    return model_type{found->center, found->radius};
  }
  [[nodiscard]] double residual(const model_type& model, index_t i) const {
    return std::abs(model.signed_distance(points_[i]));
  }

 private:
  points_view<S, D> points_;
  sphere_limits limits_;
};
export template <BorrowedPoints P>
sphere_family(P&&, sphere_limits = {}) -> sphere_family<scalar_of<P>, dimension_of<P>>;

}  // namespace cilantro
