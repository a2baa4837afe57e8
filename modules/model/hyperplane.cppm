// SPDX-License-Identifier: MIT
export module cilantro.model:hyperplane;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :data;
import :limits;

namespace cilantro {

/// The points x with normal · x + offset = 0: a plane in 3D, a line in 2D. In double, whatever the
/// points are in, since an offset far from the origin would lose most of its digits in float.
export template <int D>
struct hyperplane_model {
  Eigen::Matrix<double, D, 1> normal;  ///< Unit length; its entry of largest magnitude is positive.
  double offset = 0;                   ///< In the units of the points.

  /// Positive on the side to which the normal points. In the units of the points.
  template <class V>
  [[nodiscard]] double signed_distance(const Eigen::MatrixBase<V>& point) const {
    return normal.dot(point.template cast<double>()) + offset;
  }
  /// The nearest point of the plane.
  template <class V>
  [[nodiscard]] Eigen::Matrix<double, D, 1> project(const Eigen::MatrixBase<V>& point) const {
    return point.template cast<double>() - signed_distance(point) * normal;
  }
};

export struct hyperplane_limits {
  std::optional<direction_limit> normal = {};
};

/// Through all of the data if they are `dimension` many, and otherwise of least squares.
[[nodiscard]] std::optional<hyperplane_model<dynamic>> fit_hyperplane(
    const std::optional<gathered_points>& data, double negligible, const hyperplane_limits& limits);

/// |normal · (x − origin) + offset| of consecutive points, in S.
template <Scalar S, int D>
void hyperplane_residuals(points_view<S, D> points, const point_vector<S, D>& origin,
                          const point_vector<S, D>& normal, S offset, S* out);

/// Hyperplanes through points: Dim of them are a sample, and the least squares of more are the mean
/// and the direction of least variance. A sample is degenerate if it lies in a smaller subspace.
/// Views the points, which must outlive it.
/// Source: Pearson 1901, "On lines and planes of closest fit to systems of points in space".
export template <Scalar S, int D>
class hyperplane_family {
 public:
  using scalar = S;
  using model_type = hyperplane_model<D>;

  /// Throws `invalid_input` for limits that make no sense.
  template <BorrowedData P>
  explicit hyperplane_family(P&& points, hyperplane_limits limits = {})
      : points_{data_in(std::forward<P>(points))}, limits_{std::move(limits)} {
    if (points_.empty()) return;
    expect_sensible(limits_.normal, points_.dimension());
    index_t first = 0;
    while (first + 1 < points_.size() && !is_finite(points_[first])) ++first;
    origin_ = points_[first];
  }

  [[nodiscard]] index_t size() const { return points_.size(); }
  [[nodiscard]] index_t sample_size() const { return std::max<index_t>(points_.dimension(), 1); }
  [[nodiscard]] std::optional<model_type> fit(std::span<const index_t> indices) const {
    const auto found =
        fit_hyperplane(gather_points<S, closed>(points_, indices), negligible_ratio<S>, limits_);
    if (!found) return std::nullopt;
    return model_type{found->normal, found->offset};
  }
  [[nodiscard]] double residual(const model_type& plane, index_t i) const {
    return std::abs(plane.signed_distance(points_[i]));
  }
  void residuals(const model_type& plane, index_t first, std::span<S> out) const {
    const point_vector<S, closed> normal = plane.normal.template cast<S>();
    hyperplane_residuals<S, closed>(points_.slice(first, std::ssize(out)), origin_, normal,
                                    static_cast<S>(plane.signed_distance(origin_)), out.data());
  }

 private:
  static constexpr int closed = closed_dimension<D>;
  points_view<S, D> points_;
  hyperplane_limits limits_;
  point_vector<S, closed> origin_;  ///< A point of the set, so that residuals keep their digits.
};
export template <BorrowedData P>
hyperplane_family(P&&, hyperplane_limits = {})
    -> hyperplane_family<typename data_view_of<P>::scalar, data_view_of<P>::static_dimension>;

}  // namespace cilantro
