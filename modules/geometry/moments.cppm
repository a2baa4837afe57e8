// SPDX-License-Identifier: MIT
export module cilantro.geometry:moments;

import cilantro.standard;
import cilantro.core;
import cilantro.search;

namespace cilantro {

/// The mean and covariance of some points. The covariance is in double, since squares of floats can
/// overflow or underflow.
export template <Scalar S, int D>
struct moments {
  index_t count = 0;                       ///< The number of finite points.
  point_vector<S, D> mean;                 ///< In the units of the points.
  Eigen::Matrix<double, D, D> covariance;  ///< Divided by count − 1; zero for a single point.
};

template <Scalar S, int D>
std::optional<moments<S, D>> closed_moments(points_view<S, D> points, const execution& how);
template <Scalar S, int D>
std::optional<moments<S, D>> closed_moments(points_view<S, D> points,
                                            std::span<const std::int32_t> indices);

template <Scalar S, int D, int C>
std::optional<moments<S, D>> with_dimension(const std::optional<moments<S, C>>& found) {
  if (!found) return std::nullopt;
  return moments<S, D>{found->count, found->mean, found->covariance};
}

/// The mean and covariance of all `points`; nothing if none of them is finite. Non-finite points
/// are left out. Summed in double and relative to a point of the set, so that points far from the
/// origin lose no digits. O(N·D²); the same bits for any number of threads.
export template <PointsSource P>
[[nodiscard]] auto mean_and_covariance(const P& points, const execution& how = {})
    -> std::optional<moments<scalar_of<P>, dimension_of<P>>> {
  constexpr int D = dimension_of<P>;
  return with_dimension<scalar_of<P>, D>(closed_moments(closed_points(points), how));
}

/// As above, for the points with the given indices, which may repeat. Throws `invalid_input` for an
/// index that is out of range.
export template <PointsSource P, IndexRange R>
[[nodiscard]] auto mean_and_covariance(const P& points, R&& indices)
    -> std::optional<moments<scalar_of<P>, dimension_of<P>>> {
  constexpr int D = dimension_of<P>;
  const auto view = points_in(points);
  std::vector<std::int32_t> checked;
  for (const auto i : indices)
    checked.push_back(checked_index(i, view.size(), "mean_and_covariance"));
  return with_dimension<scalar_of<P>, D>(closed_moments<scalar_of<P>, closed_dimension<D>>(
      view, std::span<const std::int32_t>{checked}));
}

/// As above, for the neighbours that a search found among `points`.
export template <PointsSource P>
[[nodiscard]] auto mean_and_covariance(const P& points, const neighborhood<scalar_of<P>>& near) {
  return mean_and_covariance(points, near.indices());
}

}  // namespace cilantro
