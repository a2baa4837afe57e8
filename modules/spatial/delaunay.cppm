// SPDX-License-Identifier: MIT
export module cilantro.spatial:delaunay;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;

namespace cilantro {

/// Simplices (triangles in 2D, tetrahedra in 3D) that fill the convex hull of a set of points.
export template <int D = dynamic>
struct triangulation {
  static constexpr int corners = D == dynamic ? dynamic : D + 1;
  using table = Eigen::Matrix<std::int32_t, corners, dynamic>;

  /// One simplex per column, by the indices of its points: of positive orientation, which in 2D is
  /// counterclockwise, from the least index on, and ordered by these.
  table simplices;
  /// For each corner, the simplex across the face that is opposite to it; −1 at the boundary.
  table neighbors;
  index_t non_finite = 0;  ///< How many of the points were not finite; they are in no simplex.
  /// How many other points are in no simplex: those that are equal to another of a lower index, or
  /// nearer to it than about 10⁻⁷ of the extent of all points (a centimetre in 100 km), which is as
  /// fine as their squares can tell; and all points if there is no simplex.
  index_t left_out = 0;
};

struct triangulation_data {
  Eigen::Matrix<std::int32_t, dynamic, dynamic> simplices, neighbors;
};
/// The finite points in double, one per column, without an origin, and which they are.
struct finite_points {
  Eigen::MatrixXd places;
  index_list indices;
  double epsilon;  ///< Of the scalar that they had.
};
template <Scalar S>
finite_points finite_points_of(points_view<S, dynamic> points) {
  finite_points found{.places{points.dimension(), points.size()},
                      .indices = {},
                      .epsilon = double(std::numeric_limits<S>::epsilon())};
  for (index_t i = 0; i < points.size(); ++i)
    if (is_finite(points[i])) {
      found.places.col(std::ssize(found.indices)) = points[i].template cast<double>();
      found.indices.push_back(static_cast<std::int32_t>(i));
    }
  found.places.conservativeResize(points.dimension(), std::ssize(found.indices));
  return found;
}

triangulation_data triangulate(const finite_points& points);

/// The Delaunay triangulation of points with two or three coordinates: no point is inside the
/// sphere through the corners of a simplex. Where more points lie on one sphere than a simplex has
/// corners, as those of a grid do, the simplices are those at the point of the least index. Points
/// on a line, in 3D in a plane, have no simplices.
///
/// As the lower side of the convex hull of the points (x, |x|²) (Brown 1979). That the simplices
/// fill the hull, and that neighbours are on either side of the face that they share, is verified.
/// Throws `std::runtime_error` if it is not so: for points that are nearly equal, or in a strip
/// 10⁻⁹ as wide as long. O(N log N) in 2D and for points that are spread evenly in 3D, up to O(N²)
/// for others.
export template <PointsSource P>
[[nodiscard]] triangulation<dimension_of<P>> delaunay_triangulation(const P& points) {
  const auto view = points_in(points);
  expects(view.dimension() == 2 || view.dimension() == 3,
          "delaunay_triangulation: points must have two or three coordinates");
  const auto finite = finite_points_of<scalar_of<P>>(view);
  const auto found = triangulate(finite);
  triangulation<dimension_of<P>> result{.simplices = found.simplices,
                                        .neighbors = found.neighbors,
                                        .non_finite = view.size() - std::ssize(finite.indices)};
  std::vector<bool> used(view.size());
  index_t used_points = 0;
  for (index_t s = 0; s < result.simplices.cols(); ++s)
    for (index_t k = 0; k < result.simplices.rows(); ++k) {
      auto& corner = result.simplices(k, s);
      corner = finite.indices[corner];
      if (!used[corner]) ++used_points;
      used[corner] = true;
    }
  result.left_out = std::ssize(finite.indices) - used_points;
  return result;
}

}  // namespace cilantro
