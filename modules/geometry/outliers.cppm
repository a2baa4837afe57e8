// SPDX-License-Identifier: MIT
export module cilantro.geometry:outliers;

import cilantro.standard;
import cilantro.core;
import cilantro.search;

namespace cilantro {

/// The indices of the points that a filter has `kept` and `removed`, ascending.
export struct selection {
  index_list kept, removed;
};

/// Options of `statistical_outliers`.
export struct statistical_outlier_options {
  index_t neighbors = 20;  ///< How many other points near each point are averaged, at least 1.
  /// A point is removed if its mean distance exceeds the mean over all points by more than this
  /// many standard deviations.
  double deviations = 2;
  int threads = 0;
  task_monitor monitor = {};
};

/// Options of `radius_outliers`.
export struct radius_outlier_options {
  positive radius;            ///< In the units of the points.
  index_t min_neighbors = 2;  ///< How many other points within the radius a point needs to be kept.
  int threads = 0;
  task_monitor monitor = {};
};

/// The mean distances of any part of the points, as `statistical_outliers` needs them: parts are
/// added in any order, and all give the same limit, to the bit.
export struct distance_statistics {
  exact_sum sum;      ///< Of the mean distances.
  exact_sum squares;  ///< Of their squares.
  index_t count = 0;  ///< How many there are.

  /// Takes one mean distance into account, unless it is NaN.
  void add(double distance);
  /// Adds what another part of the points has.
  distance_statistics& operator+=(const distance_statistics& other);
  /// The largest mean distance that is no outlier's: the mean over all, and so many standard
  /// deviations. Points that are all equally far from theirs differ by rounding, which removes
  /// none: `epsilon` is that of the points' scalar. 0 without any.
  [[nodiscard]] double limit(double deviations, double epsilon) const;
};

template <Scalar S, int D>
std::vector<double> closed_mean_distances(points_view<S, D> points, index_t neighbors,
                                          const execution& how);
template <Scalar S, int D>
selection closed_outliers(points_view<S, D> points, const statistical_outlier_options& options);
template <Scalar S, int D>
selection closed_outliers(points_view<S, D> points, const radius_outlier_options& options);

/// The mean distance of each point to the so many other points that are nearest to it, or to all
/// others where there are fewer; NaN for points that are not finite, 0 for one without others.
/// Throws `invalid_input` for fewer than one neighbour. O(N (k + log N)).
export template <PointsSource P>
[[nodiscard]] std::vector<double> mean_neighbor_distances(const P& points, index_t neighbors,
                                                          const execution& how = {}) {
  return closed_mean_distances(closed_points(points), neighbors, how);
}

/// The statistics of such distances.
export [[nodiscard]] distance_statistics statistics_of(std::span<const double> distances,
                                                       const execution& how = {});

/// Finds outliers by their mean distance to their nearest neighbours, compared with that of all
/// points. Points that are not finite are removed. The same for any number of threads, and any
/// order of the points, since sums are exact. Throws `invalid_input` for fewer than one neighbour,
/// or deviations that are negative or NaN. Memory beside the result: a kd-tree, and 8 bytes per
/// point. O(N (k + log N)). Source: Rusu et al. 2008, "Towards 3D point cloud based object maps",
/// section 3.1.
export template <PointsSource P>
[[nodiscard]] selection statistical_outliers(const P& points,
                                             const statistical_outlier_options& options = {}) {
  return closed_outliers(closed_points(points), options);
}

/// Finds outliers by the number of other points within a radius, inclusive. Points that are not
/// finite are removed. Throws `invalid_input` for a negative number of neighbours.
export template <PointsSource P>
[[nodiscard]] selection radius_outliers(const P& points, const radius_outlier_options& options) {
  return closed_outliers(closed_points(points), options);
}

}  // namespace cilantro
