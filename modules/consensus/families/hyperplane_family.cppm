// SPDX-License-Identifier: MIT
export module cilantro.consensus:hyperplane_family;

import cilantro.standard;
import cilantro.core;
import cilantro.geometry;
import :sample;
import :constraints;
import :ransac;

namespace cilantro {

/// Which hyperplanes are allowed: their `normal`.
export struct hyperplane_limits {
  std::optional<direction_limit> normal = {};
};

/// The hyperplane through the points with the given indices if there are Dim, otherwise the
/// least-squares one.
template <Scalar S, int D>
std::optional<hyperplane_model<dynamic>> fit_hyperplane(points_view<S, D> points,
                                                        std::span<const std::int32_t> indices,
                                                        const hyperplane_limits& limits);

/// The coordinates of all points, one row per axis, relative to the first finite point: suited to
/// vector instructions, and with all digits even far from the origin.
template <Scalar S>
struct coordinate_rows {
  Eigen::Matrix<S, dynamic, dynamic, Eigen::RowMajor> rows;
  Eigen::VectorXd origin;
};
template <Scalar S, int D>
coordinate_rows<S> rows_of(points_view<S, D> points);

/// |normal · x + offset| of consecutive points, x relative to the origin of the rows.
template <Scalar S>
void hyperplane_residuals(const coordinate_rows<S>& points,
                          const Eigen::Ref<const Eigen::VectorXd>& normal, double offset,
                          index_t first, std::span<S> out);

/// A hyperplane relative to the origin of some rows.
struct plane_in_rows {
  const double* normal;
  double offset;
};
/// Adds to `sums` the scores of each plane over `count` points from `first` on.
template <Scalar S>
void score_hyperplanes(const coordinate_rows<S>& points, std::span<const plane_in_rows> planes,
                       index_t first, index_t count, const residual_scoring& scoring,
                       std::span<data_score> sums);

/// Hyperplanes through points. A sample is Dim points, degenerate if they lie in a subspace of
/// lower dimension. More points are fitted by least squares: the plane through their mean across
/// the direction of least variance. Views the points, which must outlive it, and keeps a copy of
/// their coordinates for speed.
/// Source: Pearson 1901, "On lines and planes of closest fit to systems of points in space".
export template <Scalar S, int D>
class hyperplane_family {
 public:
  using scalar = S;
  using model_type = hyperplane_model<D>;

  /// Throws `invalid_input` for limits that make no sense.
  template <BorrowedPoints P>
  explicit hyperplane_family(P&& points, hyperplane_limits limits = {})
      : points_{as_points(std::forward<P>(points))}, limits_{std::move(limits)} {
    if (points_.empty()) return;
    expect_sensible(limits_.normal, points_.dimension());
    rows_ = rows_of<S, closed>(points_);
  }

  [[nodiscard]] index_t size() const { return points_.size(); }
  [[nodiscard]] index_t sample_size() const { return std::max<index_t>(points_.dimension(), 1); }
  [[nodiscard]] std::optional<model_type> fit(std::span<const std::int32_t> indices) const {
    const auto found = fit_hyperplane<S, closed>(points_, indices, limits_);
    if (!found) return std::nullopt;
    return model_type{found->normal, found->offset};
  }
  [[nodiscard]] double residual(const model_type& plane, index_t i) const {
    return std::abs(plane.signed_distance(points_[i]));
  }
  void residuals(const model_type& plane, index_t first, std::span<S> out) const {
    hyperplane_residuals<S>(rows_, plane.normal, plane.signed_distance(rows_.origin), first, out);
  }
  void score(std::span<const model_type> planes, index_t first, index_t count,
             const residual_scoring& scoring, std::span<data_score> sums) const {
    std::array<plane_in_rows, models_at_a_time> all;
    for (std::size_t m = 0; m < planes.size(); ++m)
      all[m] = {planes[m].normal.data(), planes[m].signed_distance(rows_.origin)};
    score_hyperplanes<S>(rows_, std::span{all}.first(planes.size()), first, count, scoring, sums);
  }

 private:
  static constexpr int closed = closed_dimension<D>;
  points_view<S, D> points_;
  hyperplane_limits limits_;
  coordinate_rows<S> rows_;
};
export template <BorrowedPoints P>
hyperplane_family(P&&, hyperplane_limits = {}) -> hyperplane_family<scalar_of<P>, dimension_of<P>>;

}  // namespace cilantro
