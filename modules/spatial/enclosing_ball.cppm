// SPDX-License-Identifier: MIT
export module cilantro.spatial:enclosing_ball;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;
import cilantro.geometry;
import :convex_polytope;
import :polytope_data;

namespace cilantro {

/// The smallest ball that contains a set of points.
export struct enclosing_ball {
  Eigen::VectorXd center;  ///< In world coordinates.
  double radius;           ///< 0 for a single point.
  index_list support;      ///< Indices of the points on its surface that determine it, ascending.
};

std::optional<enclosing_ball> smallest_ball(points_view<double, dynamic> points);

/// The smallest ball that contains all finite points, of up to 12 dimensions; of a cloud in world
/// coordinates. Nothing if there is no finite point. In two and three dimensions O(N log N), of
/// which all but a little is the hull's. Welzl 1991, with the farthest point first (Gärtner 1999).
export template <PointsSource P>
[[nodiscard]] std::optional<enclosing_ball> minimum_enclosing_ball(const P& points) {
  const auto view = points_in(points);
  const Eigen::VectorXd origin = origin_in(points);
  Eigen::MatrixXd candidates(view.dimension(), 0);
  index_list indices;
  expects(view.dimension() <= 12, "minimum_enclosing_ball: points may have at most 12 coordinates");
  convex_polytope<dimension_of<P>> hull;
  if (view.dimension() == 2 || view.dimension() == 3) hull = convex_hull(points);
  if (hull.status() == polytope_status::bounded) {
    candidates = hull.vertices().matrix();
    indices.assign(hull.indices().begin(), hull.indices().end());
  } else {
    for (index_t i = 0; i < view.size(); ++i)
      if (is_finite(view[i])) indices.push_back(static_cast<std::int32_t>(i));
    candidates.resize(view.dimension(), std::ssize(indices));
    for (index_t k = 0; k < candidates.cols(); ++k)
      candidates.col(k) = view[indices[k]].template cast<double>() + origin;
  }
  auto found = smallest_ball(as_points(candidates));
  if (found)
    for (auto& i : found->support) i = indices[i];
  return found;
}

}  // namespace cilantro
