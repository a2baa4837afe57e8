// SPDX-License-Identifier: MIT
export module cilantro.clustering:kmeans;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :clusters;

namespace cilantro {

/// How the first centres are chosen.
export enum class kmeans_start {
  /// k-means++: points drawn one after another; those far from all earlier ones are more likely.
  plus_plus,
  random_points,  ///< Points drawn with equal probability.
};

/// Options of `kmeans` and `kmedians`.
export struct kmeans_options {
  kmeans_start start = kmeans_start::plus_plus;  ///< How the first centres are chosen.
  int restarts = 1;  ///< How many starts are tried; the result with the least inertia is returned.
  int max_iterations = 100;  ///< Of each start.
  /// Ends once no centroid moves farther than this, in the units of the points. At 0, it ends when
  /// no point changes its cluster.
  double tolerance = 0;
  std::uint64_t seed = 0;  ///< Determines the starts.
  int threads = 0;
  task_monitor monitor = {};
};

template <Scalar S, int D, CoordinateMetric<S> M>
std::vector<clusters::label> closed_nearest(points_view<S, D> centroids, points_view<S, D> points,
                                            const execution& how);

/// Clusters of the points nearest to each of some centres, by the metric M.
export template <Scalar S, int D, CoordinateMetric<S> M>
struct kmeans_result : clusters {
  /// `Dim × size()`: column c is the centre of cluster c.
  point_matrix<S, D> centroids;
  /// The sum of the squared distances of all points to their centres; for `kmedians`, of the
  /// distances.
  double inertia = 0;
  int iterations = 0;      ///< Of the start that was best.
  bool converged = false;  ///< Whether it ended before the limit of iterations.
  /// How often a point was compared with all centres, in all starts together.
  index_t evaluations = 0;

  /// The number of the nearest centre of each of other points, of equally near ones the first; −1
  /// for points that are not finite. Throws `invalid_input` for points of another dimension.
  template <PointsSource P>
  [[nodiscard]] std::vector<clusters::label> assign(const P& points,
                                                    const execution& how = {}) const {
    constexpr int C = closed_dimension<D>;
    return closed_nearest<S, C, M>(points_in(centroids), points_in(points), how);
  }
};

/// What a run needs besides the points: centres to start from, or how many.
template <Scalar S, int D, CoordinateMetric<S> M>
kmeans_result<S, D, M> closed_kmeans(points_view<S, D> points, index_t k, points_view<S, D> initial,
                                     const kmeans_options& options);

template <CoordinateMetric M, PointsSource P>
[[nodiscard]] auto kmeans_by(const P& points, index_t k, points_view_of<P> initial,
                             const kmeans_options& options) {
  using view = points_view_of<P>;
  using S = typename view::scalar;
  constexpr int D = view::static_dimension;
  auto found = closed_kmeans<S, closed_dimension<D>, M>(points_in(points), k, initial, options);
  if constexpr (D == closed_dimension<D>)
    return found;
  else
    return kmeans_result<S, D, M>{static_cast<clusters&&>(found),
                                  found.centroids,
                                  found.inertia,
                                  found.iterations,
                                  found.converged,
                                  found.evaluations};
}

/// Splits points into at most k clusters so that the squared distances to the mean of their cluster
/// are small. Finds the same local minimum as Lloyd's iteration, but skips most of the distances.
///
/// A centre that loses all its points moves to the point farthest from its own centre, so that
/// there are fewer than k clusters only if there are fewer than k different points. Points that are
/// not finite are in no cluster. The same for any number of threads. O(N log k) per iteration in
/// low dimension, less when centres move little; memory is about 40 bytes per point in float.
/// Throws `invalid_input` unless there are k finite points and k is at least 1, and for options
/// that are negative; `cancelled`.
/// Source: Lloyd 1982; Arthur & Vassilvitskii 2007, "k-means++"; the bounds are those of Hamerly
/// 2010, "Making k-means even faster". The two nearest centres come from a look at all of them,
/// many points at a time, or from a kd-tree where there are many centres.
export template <PointsSource P>
[[nodiscard]] auto kmeans(const P& points, index_t k, const kmeans_options& options = {}) {
  return kmeans_by<euclidean>(points, k, {}, options);
}
/// As above, from given centres, `Dim × k`, in a single start. Throws `invalid_input` also for
/// centres that are not finite or of another dimension.
export template <PointsSource P, PointsSource C>
[[nodiscard]] auto kmeans(const P& points, const C& centroids, const kmeans_options& options = {}) {
  const auto initial = points_in(centroids);
  return kmeans_by<euclidean>(points, initial.size(), initial, options);
}

/// As `kmeans`, by distances along the axes (L1), for which the best centres are the medians of
/// each coordinate: a few distant points do not move them.
export template <PointsSource P>
[[nodiscard]] auto kmedians(const P& points, index_t k, const kmeans_options& options = {}) {
  return kmeans_by<manhattan>(points, k, {}, options);
}
export template <PointsSource P, PointsSource C>
[[nodiscard]] auto kmedians(const P& points, const C& centroids,
                            const kmeans_options& options = {}) {
  const auto initial = points_in(centroids);
  return kmeans_by<manhattan>(points, initial.size(), initial, options);
}

}  // namespace cilantro
