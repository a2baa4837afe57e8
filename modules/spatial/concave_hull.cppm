// SPDX-License-Identifier: MIT
export module cilantro.spatial:concave_hull;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;
import :delaunay;

namespace cilantro {

/// How `concave_hull` works.
export struct concave_hull_options {
  /// The radius of a disc that takes away all that it can cover without a point inside, in the unit
  /// of the points: the smaller, the more closely the outline follows them. About two or three
  /// times the distance between neighbours keeps what is densely covered in one piece; infinity
  /// gives the convex hull.
  double alpha;
  /// In space alone, where it must be given: the largest distance of a point from the plane that
  /// fits best.
  double tolerance = 0;
};

/// What points in a plane cover: triangles, and the outline about them.
export struct planar_region {
  /// Closed outlines by the indices of points, each from its least index on: about covered areas
  /// counterclockwise, about holes clockwise. In space as seen from where `normal` points. Two
  /// outlines may touch in a point; none crosses another.
  std::vector<index_list> rings;
  Eigen::Matrix3Xi triangles;  ///< Counterclockwise, by the indices of points, one per column.
  double area = 0;             ///< Of all triangles.
  double perimeter = 0;        ///< The length of all rings.
  /// In space the plane normal · x = offset, the largest component of the normal positive; in 2D no
  /// coordinates.
  Eigen::VectorXd normal;
  double offset = 0;       ///< Of the plane in space; 0 in 2D.
  double thickness = 0;    ///< How far apart the points are across the plane; 0 in 2D.
  index_t non_finite = 0;  ///< How many of the points were not finite; they are left out.
  /// How many of the others are corners of no triangle: too far from others, or equal to another.
  index_t left_out = 0;
};

planar_region make_concave_hull(const finite_points& points, const Eigen::VectorXd& origin,
                                const concave_hull_options& options);

/// The outline of points in the plane, which may have notches, holes and several parts: the alpha
/// shape, made of those Delaunay triangles whose circumscribed circle has at most the radius
/// `alpha` (Edelsbrunner, Kirkpatrick and Seidel 1983). In space the points must be in a plane
/// within the tolerance; of a cloud in world coordinates. Throws `invalid_input` unless `alpha` is
/// positive, for a tolerance in 2D, and in space as `flat_convex_hull` does; otherwise as
/// `delaunay_triangulation`. O(N log N).
export template <PointsSource P>
[[nodiscard]] planar_region concave_hull(const P& points, const concave_hull_options& options) {
  const auto view = points_in(points);
  expects(view.dimension() == 2 || view.dimension() == 3,
          "concave_hull: points must have two or three coordinates");
  const auto finite = finite_points_of<scalar_of<P>>(view);
  auto found = make_concave_hull(finite, origin_in(points), options);
  found.non_finite = view.size() - std::ssize(finite.indices);
  return found;
}

}  // namespace cilantro
