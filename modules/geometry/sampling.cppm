// SPDX-License-Identifier: MIT
export module cilantro.geometry:sampling;

import cilantro.standard;
import cilantro.core;
import cilantro.search;

namespace cilantro {

/// `count` different random indices out of [0, size), ascending; every set is equally likely. All
/// indices if `count` is larger. Throws `invalid_input` for a negative count.
export [[nodiscard]] index_list random_indices(index_t size, index_t count, std::uint64_t seed = 0);

/// `count` indices out of [0, size) at equal steps, beginning with 0: the i-th is ⌊i · size /
/// count⌋. All indices if `count` is larger. Throws `invalid_input` for a negative count.
export [[nodiscard]] index_list uniform_indices(index_t size, index_t count);

/// Options of `farthest_point_sample`.
export struct farthest_point_options {
  /// The index of the point to begin with; if it is not finite, the next one that is.
  index_t first = 0;
  int threads = 0;
  task_monitor monitor = {};
};

template <Scalar S, int D>
index_list closed_farthest_points(points_view<S, D> points, index_t count,
                                  const farthest_point_options& options);

/// The indices of `count` points, in the order of selection. Each is the farthest from all selected
/// before it, so that the list covers the set evenly wherever it is cut off. Of several equally far
/// points, the one with the smallest index is selected. Points that are not finite are never
/// chosen. Throws `invalid_input` for a negative count, or a `first` that is not the index of a
/// point. O(N · count); memory beside the result: 8 bytes per point.
/// Source: Gonzalez 1985; Eldar et al. 1997, "The farthest point strategy".
export template <PointsSource P>
[[nodiscard]] index_list farthest_point_sample(const P& points, index_t count,
                                               const farthest_point_options& options = {}) {
  return closed_farthest_points(closed_points(points), count, options);
}

}  // namespace cilantro
