// SPDX-License-Identifier: MIT
export module cilantro.geometry:sampling;

import cilantro.standard;
import cilantro.core;
import cilantro.search;

namespace cilantro {

/// `count` different indices out of [0, size), ascending, each set equally likely. All of them if
/// there are no more. Throws `invalid_input` for a negative count.
export [[nodiscard]] index_list random_indices(index_t size, index_t count, std::uint64_t seed = 0);

/// `count` indices out of [0, size) at equal steps, beginning with 0: the i-th is ⌊i · size /
/// count⌋. All of them if there are no more. Throws `invalid_input` for a negative count.
export [[nodiscard]] index_list uniform_indices(index_t size, index_t count);

export struct farthest_point_options {
  index_t first = 0;  ///< The point to begin with, or the next that is finite.
  int threads = 0;
  task_monitor monitor = {};
};

template <Scalar S, int D>
index_list closed_farthest_points(points_view<S, D> points, index_t count,
                                  const farthest_point_options& options);

/// The indices of `count` points, of which each is the farthest from all before it, so that any
/// beginning of the list covers the set evenly. In the order of selection; of several equally far,
/// the first. Points that are not finite are never chosen. Throws `invalid_input` for a negative
/// count, or a `first` that is no point. O(N · count); memory beside the result: 8 bytes a point.
/// Source: Gonzalez 1985; Eldar et al. 1997, "The farthest point strategy".
export template <PointsSource P>
[[nodiscard]] index_list farthest_point_sample(const P& points, index_t count,
                                               const farthest_point_options& options = {}) {
  return closed_farthest_points(closed_points(points), count, options);
}

}  // namespace cilantro
