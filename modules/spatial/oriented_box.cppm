// SPDX-License-Identifier: MIT
export module cilantro.spatial:oriented_box;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;
import cilantro.geometry;
import :convex_polytope;
import :polytope_data;

namespace cilantro {

/// A box in any direction: the points center + axes · y with |y| <= half_extents in each
/// coordinate. Is a `Region`.
export struct oriented_box {
  Eigen::VectorXd center;  ///< In world coordinates.
  /// Orthonormal, one per column, the longest side first; right-handed.
  Eigen::MatrixXd axes;
  Eigen::VectorXd half_extents;  ///< Half the length of each side.

  /// The volume, in 2D the area.
  [[nodiscard]] double volume() const { return (2 * half_extents).prod(); }
  /// The 2^D corners, one per column: bit d of its number says on which side of axis d one is.
  [[nodiscard]] Eigen::MatrixXd corners() const {
    Eigen::MatrixXd all(center.size(), index_t{1} << center.size());
    for (index_t i = 0; i < all.cols(); ++i) {
      all.col(i) = center;
      for (index_t d = 0; d < center.size(); ++d)
        all.col(i) += ((i >> d & 1) != 0 ? 1 : -1) * half_extents[d] * axes.col(d);
    }
    return all;
  }
  /// Throws `invalid_input` unless points have `dimension` coordinates.
  void check(index_t dimension) const {
    expects(center.size() == dimension && axes.rows() == dimension && axes.cols() == dimension &&
                half_extents.size() == dimension,
            "oriented_box: center, axes and half extents must have the dimension of the points");
  }
  /// Whether the point is in the box, its boundary included.
  template <class P>
  [[nodiscard]] bool contains(const P& point) const {
    expects(static_cast<index_t>(point.size()) == center.size(),
            "oriented_box: the point must have the dimension of the box");
    for (index_t k = 0; k < center.size(); ++k) {
      double along = 0;
      for (index_t d = 0; d < center.size(); ++d)
        along += axes(d, k) * (static_cast<double>(point[d]) - center[d]);
      if (!(std::abs(along) <= half_extents[k])) return false;
    }
    return true;
  }
};

std::optional<oriented_box> smallest_box_about(const polytope_data& hull);

/// The smallest box in any direction that contains all finite points, with two or three
/// coordinates; of a cloud in world coordinates. It is larger by what rounding asks for, so that
/// `contains` holds for each, also where it is flat. Nothing if there is no finite point.
///
/// In 2D the smallest there is (Freeman and Shapira 1975). In 3D the smallest one that is found
/// from boxes with a side on a facet, or along two edges, of the convex hull by turning it about
/// its axes as long as it becomes smaller (Chang, Gorissen and Melchior 2011); for hulls of more
/// than some thousand facets, from the largest ones. O(N log N + F · V log V) with F facets and V
/// vertices.
export template <PointsSource P>
[[nodiscard]] std::optional<oriented_box> minimum_volume_box(const P& points) {
  const auto view = points_in(points);
  expects(view.dimension() == 2 || view.dimension() == 3,
          "minimum_volume_box: points must have two or three coordinates");
  return smallest_box_about(*convex_hull(points).shared());
}

}  // namespace cilantro
