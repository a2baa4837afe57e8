// SPDX-License-Identifier: MIT
export module cilantro.model:sphere;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :data;
import :limits;

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

export struct sphere_limits {
  radius_limit radius = {};
};

/// Through all of the data if they are one more than their dimension, and otherwise of least
/// squares. Nothing where they lie in a hyperplane.
[[nodiscard]] std::optional<sphere_model<dynamic>> fit_sphere(
    const std::optional<gathered_points>& data, double negligible, const sphere_limits& limits);

/// Spheres through points of any dimension; circles in 2D. Dim + 1 points are a sample, degenerate
/// if they lie in a hyperplane; more are fitted by least squares of the distances to the sphere.
/// Views the points, which must outlive it.
/// Source: Kåsa 1976 for the start; Gander, Golub & Strebel 1994, "Least-squares fitting of circles
/// and ellipses", section 4, for the iteration.
export template <Scalar S, int D>
class sphere_family {
 public:
  using model_type = sphere_model<D>;

  /// Throws `invalid_input` for limits that make no sense.
  template <BorrowedPlaces P>
  explicit sphere_family(P&& points, sphere_limits limits = {})
      : points_{as_places(std::forward<P>(points))}, limits_{limits} {
    expect_sensible(limits_.radius);
  }

  [[nodiscard]] index_t size() const { return points_.size(); }
  [[nodiscard]] index_t sample_size() const { return points_.dimension() + 1; }
  [[nodiscard]] std::optional<model_type> fit(std::span<const index_t> indices) const {
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
export template <BorrowedPlaces P>
sphere_family(P&&, sphere_limits = {})
    -> sphere_family<typename places_view_of<P>::scalar, places_view_of<P>::static_dimension>;

}  // namespace cilantro
