// SPDX-License-Identifier: MIT
export module cilantro.clustering:scores;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :clusters;

namespace cilantro {

/// How well two labelings of the same points agree, whatever their clusters are called: 1 if they
/// group the points alike, 0 on average for random labels, negative if they agree less than that.
/// Each label, even −1, counts as a cluster. 1 if there are no points, or neither labeling splits
/// them. Throws `invalid_input` for different sizes. O(N log N).
/// Source: Hubert & Arabie 1985, "Comparing partitions", equation 5.
export [[nodiscard]] double adjusted_rand_index(std::span<const std::int32_t> a,
                                                std::span<const std::int32_t> b);

/// As above, by how much one labeling tells about the other, in [0, 1]: their mutual information
/// divided by the mean of their entropies. 1 if neither splits the points.
/// Source: Strehl & Ghosh 2002, "Cluster ensembles"; with the arithmetic mean.
export [[nodiscard]] double normalized_mutual_information(std::span<const std::int32_t> a,
                                                          std::span<const std::int32_t> b);

template <Scalar S, int D>
std::vector<double> closed_silhouettes(points_view<S, D> points,
                                       std::span<const std::int32_t> labels, const execution& how);

/// For each point, how much nearer its own cluster is than the next one, from −1 to 1: (b − a) /
/// max(a, b), where a is the mean distance to the others of its cluster and b the least mean
/// distance to another cluster. 0 for a point that is alone in its cluster, has no cluster or is
/// not finite, and for all points if there is only one cluster. Throws `invalid_input` unless there
/// is one label per point. O(N²).
/// Source: Rousseeuw 1987, "Silhouettes".
export template <PointsSource P>
[[nodiscard]] std::vector<double> silhouettes(const P& points, std::span<const std::int32_t> labels,
                                              const execution& how = {}) {
  using view = points_view_of<P>;
  return closed_silhouettes<typename view::scalar, closed_dimension<view::static_dimension>>(
      points_in(points), labels, how);
}

/// The mean of the silhouettes of the points that are in a cluster; 0 if there are none.
export template <PointsSource P>
[[nodiscard]] double silhouette(const P& points, std::span<const std::int32_t> labels,
                                const execution& how = {}) {
  double sum = 0;
  index_t count = 0;
  const auto all = silhouettes(points, labels, how);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (labels[i] < 0) continue;
    sum += all[i];
    ++count;
  }
  return count > 0 ? sum / double(count) : 0;
}

}  // namespace cilantro
