// SPDX-License-Identifier: MIT
export module cilantro.consensus:line_family;

import cilantro.standard;
import cilantro.core;
import cilantro.geometry;
import :sample;
import :constraints;

namespace cilantro {

/// Which lines are allowed: their `direction`.
export struct line_limits {
  std::optional<direction_limit> direction = {};
};

[[nodiscard]] std::optional<line_model<dynamic>> fit_line(
    const std::optional<principal_frame>& frame, const line_limits& limits);

/// Lines through points of any dimension. A sample is two points, degenerate if they are equal.
/// More points are fitted by least squares: the line through their mean along the direction of
/// largest variance. Views the points, which must outlive it.
/// Source: Pearson 1901.
export template <Scalar S, int D>
class line_family {
 public:
  using model_type = line_model<D>;

  /// Throws `invalid_input` for limits that make no sense.
  template <BorrowedPoints P>
  explicit line_family(P&& points, line_limits limits = {})
      : points_{as_points(std::forward<P>(points))}, limits_{std::move(limits)} {
    if (!points_.empty()) expect_sensible(limits_.direction, points_.dimension());
  }

  [[nodiscard]] index_t size() const { return points_.size(); }
  [[nodiscard]] index_t sample_size() const { return 2; }
  [[nodiscard]] std::optional<model_type> fit(std::span<const std::int32_t> indices) const {
    if (indices.size() < 2) return std::nullopt;
    const auto found = fit_line(frame_of<S, closed_dimension<D>>(points_, indices), limits_);
    if (!found) return std::nullopt;
    return model_type{found->point, found->direction};
  }
  [[nodiscard]] double residual(const model_type& model, index_t i) const {
    return model.distance(points_[i]);
  }

 private:
  points_view<S, D> points_;
  line_limits limits_;
};
export template <BorrowedPoints P>
line_family(P&&, line_limits = {}) -> line_family<scalar_of<P>, dimension_of<P>>;

}  // namespace cilantro
