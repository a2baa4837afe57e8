// SPDX-License-Identifier: MIT
export module cilantro.geometry:groups;

import cilantro.standard;
import cilantro.core;
import cilantro.search;

namespace cilantro {

/// Some of the points 0 to N − 1, sorted into groups: the members of group g are the entries from
/// `offsets[g]` to before `offsets[g + 1]` of `members`, ascending. A range of groups.
export struct point_groups {
  std::vector<index_t> offsets = {0};  ///< One more than there are groups.
  buffer<std::int32_t> members;

  [[nodiscard]] index_t size() const { return std::ssize(offsets) - 1; }
  [[nodiscard]] auto begin() const [[clang::lifetimebound]] {
    return indexed_iterator{indexed_rows{this}, 0};
  }
  [[nodiscard]] auto end() const [[clang::lifetimebound]] { return begin() + size(); }
  /// The members of group `g`. Precondition: 0 <= g < size().
  [[nodiscard]] std::span<const std::int32_t> operator[](index_t g) const [[clang::lifetimebound]] {
    const auto begin = static_cast<std::size_t>(offsets[g]);
    const auto end = static_cast<std::size_t>(offsets[static_cast<std::size_t>(g) + 1]);
    return std::span{members}.subspan(begin, end - begin);
  }
};

template <Scalar S, int D>
point_matrix<S, D> closed_group_means(points_view<S, D> values, const point_groups& groups,
                                      const execution& how);
template <Scalar S, int D>
point_matrix<S, D> closed_group_directions(points_view<S, D> directions, const point_groups& groups,
                                           const execution& how);

/// The mean of each group of columns, `Dim × groups`. Columns that are not finite are left out; a
/// group of only such columns gets NaN. Summed in double and in the order of the points.
export template <PointsSource P>
[[nodiscard]] auto group_means(const P& values, const point_groups& groups,
                               const execution& how = {}) {
  return point_matrix<scalar_of<P>, dimension_of<P>>(
      closed_group_means(closed_points(values), groups, how));
}

/// The mean direction of each group of unit vectors, `Dim × groups`, at unit length. Directions are
/// flipped to the side of the first one of their group before they are added, since normals of one
/// surface may be oriented either way. Zero where no direction is known, or where they cancel.
export template <PointwiseVectors P>
[[nodiscard]] auto group_directions(const P& directions, const point_groups& groups,
                                    const execution& how = {}) {
  return point_matrix<scalar_of<P>, dimension_of<P>>(
      closed_group_directions(closed_points(directions), groups, how));
}

}  // namespace cilantro
