// SPDX-License-Identifier: MIT
export module cilantro.spatial:flat_hull;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;

namespace cilantro {

/// How `flat_convex_hull` works.
export struct flat_hull_options {
  /// The largest distance of a point from the plane, in the unit of the points. Beyond it the call
  /// throws, since the polygon would leave out more than was meant.
  double tolerance;
};

/// The outline of points that lie in a plane, or nearly so.
export struct flat_hull {
  Eigen::Vector3d normal;  ///< Of unit length; its largest component is positive.
  double offset;           ///< normal · x = offset in the plane.
  /// The corners in the plane, counterclockwise as seen from where the normal points, one per
  /// column, from that with the least index on.
  Eigen::Matrix3Xd polygon;
  index_list indices;  ///< For each corner its index in the points.
  double area;         ///< Of the polygon.
  double thickness;    ///< How far apart the points are across the plane.
  index_t non_finite;  ///< How many of the points were not finite; they are left out.
};

flat_hull make_flat_hull(const Eigen::Matrix3Xd& points, const index_list& indices,
                         index_t non_finite, const flat_hull_options& options);

/// The plane that fits best to points in space (least squares), and the convex polygon in it that
/// encloses them: of a table top, a wall, the points of a plane that `ransac` has found. Of a cloud
/// in world coordinates. Throws `invalid_input` if the finite points do not determine a plane, if
/// one of them is farther from it than the tolerance, and for a tolerance that is not positive.
/// O(N log N).
export template <PointsSource P>
[[nodiscard]] flat_hull flat_convex_hull(const P& points, const flat_hull_options& options) {
  const auto view = points_in(points);
  expects(view.dimension() == 3, "flat_convex_hull: points must have three coordinates");
  const Eigen::VectorXd origin = origin_in(points);
  Eigen::Matrix3Xd finite(3, view.size());
  index_list indices;
  for (index_t i = 0; i < view.size(); ++i)
    if (is_finite(view[i])) {
      for (int d = 0; d < 3; ++d)
        finite(d, std::ssize(indices)) = static_cast<double>(view[i][d]) + origin[d];
      indices.push_back(static_cast<std::int32_t>(i));
    }
  finite.conservativeResize(3, std::ssize(indices));
  return make_flat_hull(finite, indices, view.size() - std::ssize(indices), options);
}

}  // namespace cilantro
