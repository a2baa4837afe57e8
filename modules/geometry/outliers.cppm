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

template <Scalar S, int D>
selection closed_outliers(points_view<S, D> points, const statistical_outlier_options& options);
template <Scalar S, int D>
selection closed_outliers(points_view<S, D> points, const radius_outlier_options& options);

/// Finds outliers by their mean distance to their nearest neighbours, compared with that of all
/// points. Points that are not finite are removed. The same for any number of threads. Throws
/// `invalid_input` for fewer than one neighbour, or deviations that are negative or NaN. Memory
/// beside the result: a kd-tree, and 8 bytes per point. O(N (k + log N)).
/// Source: Rusu et al. 2008, "Towards 3D point cloud based object maps", section 3.1.
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
