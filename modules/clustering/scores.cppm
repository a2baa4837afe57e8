// SPDX-License-Identifier: MIT
export module cilantro.clustering:scores;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :clusters;

namespace cilantro {

/// How well two labelings of the same points agree, whatever their clusters are called: 1 if they
/// are the same, 0 on average for labels at random, and below for less than that. Each label,
/// also −1, is a cluster. 1 for no points and where neither labeling splits anything.
/// Throws `invalid_input` for different sizes. O(N log N).
/// Source: Hubert & Arabie 1985, "Comparing partitions", equation 5.
export [[nodiscard]] double adjusted_rand_index(std::span<const std::int32_t> a,
                                                std::span<const std::int32_t> b);

/// As above by what one labeling tells about the other, in [0, 1]: their mutual information over
/// the mean of their entropies. 1 where neither splits anything.
/// Source: Strehl & Ghosh 2002, "Cluster ensembles"; with the arithmetic mean.
export [[nodiscard]] double normalized_mutual_information(std::span<const std::int32_t> a,
                                                          std::span<const std::int32_t> b);

template <Scalar S, int D>
std::vector<double> closed_silhouettes(points_view<S, D> points,
                                       std::span<const std::int32_t> labels, const execution& how);

/// For each point how much nearer its own cluster is than the next, from −1 to 1: (b − a) / max(a,
/// b), where a is the mean distance to the others of its cluster and b the least mean distance to
/// another cluster. 0 for a point that is alone in its cluster, that has no cluster or is not
/// finite, and where there is one cluster only. Throws `invalid_input` unless there is one label a
/// point. O(N²).
/// Source: Rousseeuw 1987, "Silhouettes".
export template <PointsSource P>
[[nodiscard]] std::vector<double> silhouettes(const P& points, std::span<const std::int32_t> labels,
                                              const execution& how = {}) {
  using view = points_view_of<P>;
  return closed_silhouettes<typename view::scalar, closed_dimension<view::static_dimension>>(
      points_in(points), labels, how);
}

/// The mean of the silhouettes of the points that have a cluster; 0 if none has.
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
