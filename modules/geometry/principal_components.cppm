// SPDX-License-Identifier: MIT
export module cilantro.geometry:principal_components;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :covariance;
import :moments;

namespace cilantro {

/// The axes along which some points vary, in descending order of variance.
export template <Scalar S, int D>
struct principal_component_basis {
  index_t count = 0;                    ///< The number of points that were used.
  point_vector<S, D> mean;              ///< The mean of the points, where the axes cross.
  Eigen::Matrix<S, D, D> axes;          ///< Orthonormal and right-handed, one per column.
  point_vector<double, D> eigenvalues;  ///< Variances along the axes, descending, not negative.

  /// The share of the variance along each axis; they add up to 1, or are all 0 if nothing varies.
  [[nodiscard]] point_vector<double, D> explained_variance() const {
    using vector = point_vector<double, D>;
    const double total = eigenvalues.sum();
    return total > 0 ? vector{eigenvalues / total} : vector{vector::Zero(eigenvalues.size())};
  }

  template <class P>
  static constexpr bool fits = std::same_as<scalar_of<P>, S> &&
                               (D == dynamic || dimension_of<P> == dynamic || dimension_of<P> == D);

  /// The coordinates of points along the first K axes, `K × N`.
  template <int K, PointsSource P>
    requires fits<P> && (D == dynamic || K <= D)
  [[nodiscard]] point_matrix<S, K> project(const P& points) const {
    return coordinates_of<K>(points, K);
  }
  /// As above for a number of axes known at run time. Throws `invalid_input` for more than Dim, and
  /// for points of another dimension.
  template <PointsSource P>
    requires fits<P>
  [[nodiscard]] point_matrix<S, dynamic> project(const P& points, index_t axis_count) const {
    return coordinates_of<dynamic>(points, axis_count);
  }
  /// The points that have the given coordinates along the first axes, `Dim × N`. From projected
  /// points, this gives the nearest points in the subspace through the mean that these axes span.
  template <PointsSource P>
    requires std::same_as<scalar_of<P>, S>
  [[nodiscard]] point_matrix<S, D> reconstruct(const P& projected) const {
    const auto view = points_in(projected);
    expects(view.dimension() <= axes.cols(),
            "reconstruct: there are more coordinates than principal components");
    point_matrix<S, D> points = axes.leftCols(view.dimension()) * view.matrix();
    points.colwise() += mean;
    return points;
  }

 private:
  template <int K, class P>
  [[nodiscard]] point_matrix<S, K> coordinates_of(const P& points, index_t axis_count) const {
    const auto view = points_in(points);
    expects(0 <= axis_count && axis_count <= axes.cols(),
            "project: there must be from 0 to as many axes as dimensions");
    expects(view.dimension() == mean.size(),
            "project: the points must have the dimension of the principal components");
    return axes.leftCols(axis_count).transpose() * (view.matrix().colwise() - mean);
  }
};

/// Eigenvalues of a symmetric matrix, descending and not negative, and its eigenvectors, whose
/// determinant is made positive by the sign of the last.
void descending_axes(const Eigen::MatrixXd& covariance, Eigen::VectorXd& eigenvalues,
                     Eigen::MatrixXd& axes);

template <Scalar S, int D>
std::optional<principal_component_basis<S, D>> basis_of(const std::optional<moments<S, D>>& found) {
  if (!found) return std::nullopt;
  Eigen::VectorXd eigenvalues;
  Eigen::MatrixXd axes;
  descending_axes(found->covariance, eigenvalues, axes);
  return principal_component_basis<S, D>{found->count, found->mean, axes.template cast<S>(),
                                         eigenvalues};
}

/// Principal component analysis of all points; nothing if none is finite. Uses the sample
/// covariance, or any `CovarianceEstimator`. O(N·D² + D³).
/// Source: Jolliffe 2002, "Principal component analysis", chapter 1.
export template <PointsSource P>
[[nodiscard]] auto principal_components(const P& points, const execution& how = {}) {
  return basis_of(mean_and_covariance(points, how));
}
export template <PointsSource P, CovarianceEstimator<scalar_of<P>, dimension_of<P>> E>
[[nodiscard]] auto principal_components(const P& points, const E& estimate) {
  return basis_of(mean_and_covariance(points, estimate));
}

/// As above, for the points with the given indices. Throws `invalid_input` for an index that is out
/// of range.
export template <PointsSource P, IndexRange R>
[[nodiscard]] auto principal_components(const P& points, R&& indices) {
  return basis_of(mean_and_covariance(points, std::forward<R>(indices)));
}

}  // namespace cilantro
