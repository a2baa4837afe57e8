// SPDX-License-Identifier: MIT
export module cilantro.tiles:kmeans_tiles;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.cloud;
import cilantro.clustering;
import :tiled_cloud;

namespace cilantro {

/// The centres that `kmeans` finds in a survey, the one with most points first; of equally large
/// ones, the one with the least coordinates.
export template <Scalar S, int D>
struct survey_kmeans_result {
  point_matrix<S, D> centroids;  ///< `Dim × size()`, relative to the origin of the survey.
  std::vector<index_t> sizes;    ///< How many points are nearest to each.
  double inertia = 0;      ///< The sum of the squared distances of all points to their centres.
  int iterations = 0;      ///< How often the centres have moved, over all points.
  bool converged = false;  ///< Whether it ended before the limit of iterations.

  [[nodiscard]] index_t size() const { return centroids.cols(); }
  /// The number of the nearest centre of each point, of equally near ones the first; −1 for points
  /// that are not finite. So are tiles labelled: `survey | with_reach(0, [found](auto cloud) {
  /// cloud.set_attribute("cluster", found.assign(cloud.points)); return cloud; })`.
  [[nodiscard]] std::vector<clusters::label> assign(const point_matrix<S, D>& points,
                                                    const execution& how = {}) const {
    kmeans_result<S, D, euclidean> nearest;
    nearest.centroids = centroids;
    return nearest.assign(points, how);
  }
};

/// Splits the points of a survey, after its steps, into at most k clusters so that the squared
/// distances to the mean of their cluster are small, by Lloyd's iteration over all tiles with exact
/// sums: the same bits for any tiles, threads and ranks.
///
/// It starts from what `kmeans` with these options finds among a sample of 100 k points, at least
/// 10,000, that a hash of their coordinates chooses; so few passes over the survey are left, one
/// for each iteration, one for the sample, and a last one. A centre that loses all its points moves
/// to the point that is farthest from its own centre in another cluster, the farthest of all first;
/// there are fewer than k clusters only if there are fewer than k different points, or iterations
/// were not enough.
///
/// O(N k) an iteration. Memory beside that of tiles: 5 kB for each centre, and as much for each
/// that a tile at work meets, and that of `kmeans` for the sample. Throws `invalid_input` unless
/// there are k points and k is at least 1, for options that are negative, and for `.threads`, which
/// are those of `open_tiles`; what reading and steps throw; and `cancelled`.
/// Source: Lloyd 1982; Bradley & Fayyad 1998, "Refining initial points for k-means clustering".
export template <Scalar S, int D>
[[nodiscard]] survey_kmeans_result<S, D> kmeans(const tiled_cloud<S, D>& cloud, index_t k,
                                                const kmeans_options& options = {});
/// As above, from given centres, `Dim × k` and relative to `cloud.origin()`, without a sample,
/// so that `.start`, `.restarts` and `.seed` choose nothing.
/// Throws `invalid_input` also for centres that are not finite.
export template <Scalar S, int D>
[[nodiscard]] survey_kmeans_result<S, D> kmeans(
    const tiled_cloud<S, D>& cloud, const std::type_identity_t<point_matrix<S, D>>& centroids,
    const kmeans_options& options = {});

}  // namespace cilantro
