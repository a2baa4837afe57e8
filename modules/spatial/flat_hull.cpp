// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>
module cilantro.spatial;

namespace cilantro {

flat_hull make_flat_hull(const Eigen::Matrix3Xd& points, const index_list& indices,
                         index_t non_finite, const flat_hull_options& options) {
  expects(options.tolerance > 0 && std::isfinite(options.tolerance),
          "flat_convex_hull: the tolerance must be positive");
  const char* no_plane = "flat_convex_hull: the points do not determine a plane";
  expects(points.cols() >= 3, no_plane);
  const Eigen::Vector3d middle = points.rowwise().mean();
  const Eigen::Matrix3Xd arms = points.colwise() - middle;
  const auto spread = decompose_symmetric<3>(arms * arms.transpose());
  expects(spread.values[1] > 1e-12 * spread.values[2], no_plane);

  flat_hull found{.non_finite = non_finite};
  found.normal = spread.vectors.col(0);
  Eigen::Index largest = 0;
  found.normal.cwiseAbs().maxCoeff(&largest);
  if (found.normal[largest] < 0) found.normal = -found.normal;
  const Eigen::Vector3d u = spread.vectors.col(2), v = found.normal.cross(u);
  const Eigen::RowVectorXd heights = found.normal.transpose() * arms;
  const double farthest = heights.cwiseAbs().maxCoeff();
  expects(farthest <= options.tolerance,
          "flat_convex_hull: a point is " + in_digits(farthest) +
              " away from the plane that fits best, more than the tolerance");
  found.offset = found.normal.dot(middle);
  found.thickness = heights.maxCoeff() - heights.minCoeff();

  Eigen::Matrix2Xd flat(2, arms.cols());
  flat << u.transpose() * arms, v.transpose() * arms;
  const auto hull = convex_hull(flat);
  expects(hull.affine_dimension() == 2, no_plane);
  found.area = hull.volume();
  // From corner to corner along the facets, which are edges.
  const auto corners = hull.vertices();
  std::vector<std::int32_t> ring(corners.size());
  for (index_t i = 0; i < corners.size(); ++i) ring[i] = static_cast<std::int32_t>(i);
  const Eigen::Vector2d center = *hull.centroid();
  std::ranges::sort(ring, {}, [&](auto i) {
    return std::atan2(corners[i][1] - center[1], corners[i][0] - center[0]);
  });
  std::ranges::rotate(ring, std::ranges::min_element(ring));
  found.polygon.resize(3, corners.size());
  for (index_t k = 0; k < corners.size(); ++k) {
    found.polygon.col(k) = middle + u * corners[ring[k]][0] + v * corners[ring[k]][1];
    found.indices.push_back(indices[hull.indices()[ring[k]]]);
  }
  return found;
}

}  // namespace cilantro
