// SPDX-License-Identifier: MIT
export module cilantro.geometry:outliers;

import cilantro.standard;
import cilantro.core;
import cilantro.search;

namespace cilantro {

/// The points that a filter keeps, and those that it removes, by ascending index.
export struct selection {
  index_list kept, removed;
};

export struct statistical_outlier_options {
  index_t neighbors = 20;  ///< Others around each point whose mean distance is taken, at least 1.
  /// Removed is what is farther from its neighbours than the mean over all points by more than so
  /// many standard deviations.
  double deviations = 2;
  int threads = 0;
  task_monitor monitor = {};
};

export struct radius_outlier_options {
  positive radius;            ///< In the units of the points.
  index_t min_neighbors = 2;  ///< Others within the radius that a point needs to stay.
  int threads = 0;
  task_monitor monitor = {};
};

template <Scalar S, int D>
selection closed_outliers(points_view<S, D> points, const statistical_outlier_options& options);
template <Scalar S, int D>
selection closed_outliers(points_view<S, D> points, const radius_outlier_options& options);

/// Tells points from outliers by the mean distance to their nearest others, compared with that of
/// all points. Points that are not finite are removed. The same for any number of threads.
/// Throws `invalid_input` for fewer than one neighbour, or deviations that are negative or NaN.
/// Memory beside the result: a kd-tree, and 8 bytes a point. O(N (k + log N)).
/// Source: Rusu et al. 2008, "Towards 3D point cloud based object maps", section 3.1.
export template <PointsSource P>
[[nodiscard]] selection statistical_outliers(const P& points,
                                             const statistical_outlier_options& options = {}) {
  return closed_outliers(closed_points(points), options);
}

/// Tells points from outliers by how many others there are within a radius, a point exactly there
/// among them. Points that are not finite are removed.
/// Throws `invalid_input` for a negative number of neighbours, or a radius that is negative or NaN.
export template <PointsSource P>
[[nodiscard]] selection radius_outliers(const P& points, const radius_outlier_options& options) {
  return closed_outliers(closed_points(points), options);
}

}  // namespace cilantro
