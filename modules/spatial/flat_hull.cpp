// SPDX-License-Identifier: MIT
module cilantro.spatial;

import :flat_view;

namespace cilantro {

flat_hull make_flat_hull(const Eigen::Matrix3Xd& points, const index_list& indices,
                         index_t non_finite, const flat_hull_options& options) {
  const auto view = flattened(points, options.tolerance, "flat_convex_hull");
  const auto hull = convex_hull(view.places);
  expects(hull.affine_dimension() == 2, "flat_convex_hull: the points do not determine a plane");
  flat_hull found{.normal = view.normal,
                  .offset = view.normal.dot(view.middle),
                  .area = hull.volume(),
                  .thickness = view.thickness,
                  .non_finite = non_finite};
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
    found.polygon.col(k) =
        view.middle + view.u * corners[ring[k]][0] + view.v * corners[ring[k]][1];
    found.indices.push_back(indices[hull.indices()[ring[k]]]);
  }
  return found;
}

}  // namespace cilantro
