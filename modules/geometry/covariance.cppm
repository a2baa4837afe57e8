// SPDX-License-Identifier: MIT
export module cilantro.geometry:covariance;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :moments;

namespace cilantro {

/// Estimates the mean and covariance of the points with the given indices.
///
/// Semantics: `estimate(points, indices)` returns nothing if there is no result; points that are
/// not finite are left out; the result depends on nothing but the arguments. Called from several
/// threads at once. The first index of a neighbourhood is the nearest point, usually the query.
/// Models: `sample_covariance`, `minimum_covariance_determinant`; any lambda that takes
/// `points_view<S, D>` and `std::span<const std::int32_t>` and returns `moments<S, D>` or an
/// optional of it.
export template <class E, class S, int D>
concept CovarianceEstimator =
    requires(const E& estimate, points_view<S, D> points, std::span<const std::int32_t> indices) {
      { estimate(points, indices) } -> std::convertible_to<std::optional<moments<S, D>>>;
    };

/// The usual sample covariance, in which all points have the same weight.
export struct sample_covariance {
  template <Scalar S, int D>
  std::optional<moments<S, D>> operator()(points_view<S, D> points,
                                          std::span<const std::int32_t> indices) const {
    return with_dimension<S, D>(closed_moments<S, closed_dimension<D>>(points, indices));
  }
};
static_assert(CovarianceEstimator<sample_covariance, float, 3>);

/// 0 to `size` − 1: all points, for an estimator. Throws `invalid_input` for more than 2³¹ − 1.
index_list all_indices(index_t size);

/// The mean and covariance of all `points`, by an estimator of your choice; nothing if it has no
/// result.
export template <PointsSource P, CovarianceEstimator<scalar_of<P>, dimension_of<P>> E>
[[nodiscard]] auto mean_and_covariance(const P& points, const E& estimate)
    -> std::optional<moments<scalar_of<P>, dimension_of<P>>> {
  const auto view = points_in(points);
  return estimate(view, std::span<const std::int32_t>{all_indices(view.size())});
}

template <Scalar S, int D>
Eigen::VectorX<S> closed_mahalanobis(points_view<S, D> points, const moments<S, D>& of);

/// The distance of every point from the mean, in standard deviations: √((x − μ)ᵀ Σ⁻¹ (x − μ)).
/// Infinite if x differs from the mean in a direction in which Σ has no extent; NaN for points that
/// are not finite. Compare its square to `chi_square_quantile(p, Dim)`.
/// Source: Mahalanobis 1936.
export template <PointsSource P>
[[nodiscard]] auto mahalanobis_distances(const P& points,
                                         const moments<scalar_of<P>, dimension_of<P>>& of) {
  constexpr int C = closed_dimension<dimension_of<P>>;
  return closed_mahalanobis<scalar_of<P>, C>(
      points_in(points), moments<scalar_of<P>, C>{of.count, of.mean, of.covariance});
}

/// The number that a chi-square variable with `degrees_of_freedom` stays below with probability
/// `p`: a share p of normally distributed points has a squared Mahalanobis distance below it.
/// Throws `invalid_input` unless 0 < p < 1 and `degrees_of_freedom` is at least 1. Accurate to
/// 1e-9.
export [[nodiscard]] double chi_square_quantile(double p, index_t degrees_of_freedom);
/// The probability that a chi-square variable is at most x, for x >= 0. Throws `invalid_input` for
/// NaN, and unless `degrees_of_freedom` is at least 1.
export [[nodiscard]] double chi_square_probability(double x, index_t degrees_of_freedom);

/// Robust mean and covariance: those of the subset, a given share of the points, whose covariance
/// has the smallest determinant. The other points may lie anywhere.
///
/// Random subsets of Dim + 1 points are each refined by concentration steps; the best are refined
/// until nothing changes. For more than 600 points, the search begins in disjoint subsets of 300.
/// The covariance is scaled so that it is consistent for normally distributed points. A flat or
/// linear majority gives the singular covariance of the points on it, as it should. If there are
/// too few points to leave any out, the result is the sample covariance. Random choices depend only
/// on the seed and the first index.
/// Source: Rousseeuw & Van Driessen 1999, "A fast algorithm for the minimum covariance determinant
/// estimator"; the scale is that of Croux & Haesbroeck 1999.
export struct minimum_covariance_determinant {
  double share = 0.75;  ///< Of the finite points, in [0.5, 1].
  /// Random subsets to begin with; at a share of 0.75, a handful is enough to hit good points.
  int trials = 30;
  /// If given, the final result is that of all points up to this squared Mahalanobis distance;
  /// `chi_square_quantile(0.975, Dim)` is usual.
  std::optional<double> rejection = {};
  std::uint64_t seed = 0;  ///< Determines the random subsets.

  /// Throws `invalid_input` for a share outside [0.5, 1], no trials, or a rejection that is not
  /// positive.
  template <Scalar S, int D>
  std::optional<moments<S, D>> operator()(points_view<S, D> points,
                                          std::span<const std::int32_t> indices) const;
};

template <Scalar S, int D>
std::optional<moments<S, D>> closed_minimum_determinant(points_view<S, D> points,
                                                        std::span<const std::int32_t> indices,
                                                        const minimum_covariance_determinant& how);

template <Scalar S, int D>
std::optional<moments<S, D>> minimum_covariance_determinant::operator()(
    points_view<S, D> points, std::span<const std::int32_t> indices) const {
  return with_dimension<S, D>(
      closed_minimum_determinant<S, closed_dimension<D>>(points, indices, *this));
}
static_assert(CovarianceEstimator<minimum_covariance_determinant, double, dynamic>);

}  // namespace cilantro
