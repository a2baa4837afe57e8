// SPDX-License-Identifier: MIT
module cilantro.spatial;

import :flat_view;

namespace cilantro {
namespace {

using table = Eigen::Matrix<std::int32_t, dynamic, dynamic>;

/// Of the circle through the corners; in units of their distance, so that products are in range.
double circumradius(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  const double unit = std::max((b - a).cwiseAbs().maxCoeff(), (c - a).cwiseAbs().maxCoeff());
  const Eigen::Vector2d ab = (b - a) / unit, ac = (c - a) / unit;
  const double doubled_area = std::abs(ab[0] * ac[1] - ab[1] * ac[0]);
  return unit * (ab.norm() * ac.norm() * (ac - ab).norm() / (2 * doubled_area));
}

/// The boundary of the chosen triangles, from edge to edge. At a point where the outline touches
/// itself it goes on about the same triangles, so that rings never cross.
std::vector<index_list> rings_about(const table& triangles, const table& neighbors,
                                    const std::vector<bool>& chosen) {
  const auto is_outside = [&](std::int32_t t) { return t < 0 || !chosen[t]; };
  // Edge k of a triangle is opposite to corner k, from corner k + 1 to corner k + 2.
  std::vector<bool> done(triangles.size());
  std::vector<index_list> rings;
  for (std::int32_t first = 0; first < triangles.cols(); ++first)
    for (int start = 0; start < 3; ++start) {
      if (!chosen[first] || !is_outside(neighbors(start, first)) || done[3 * first + start])
        continue;
      index_list ring;
      std::int32_t t = first;
      int edge = start;
      do {
        done[3 * t + edge] = true;
        ring.push_back(triangles((edge + 1) % 3, t));
        // About the edge's end, over triangles that are inside, to the next edge at the boundary.
        const auto pivot = triangles((edge + 2) % 3, t);
        edge = (edge + 1) % 3;
        while (!is_outside(neighbors(edge, t))) {
          t = neighbors(edge, t);
          int at = 0;
          while (triangles(at, t) != pivot) ++at;
          edge = (at + 2) % 3;
        }
      } while (t != first || edge != start);
      std::ranges::rotate(ring, std::ranges::min_element(ring));
      rings.push_back(std::move(ring));
    }
  std::ranges::sort(rings);
  return rings;
}

}  // namespace

planar_region make_concave_hull(const finite_points& points, const Eigen::VectorXd& origin,
                                const concave_hull_options& options) {
  expects(options.alpha > 0, "concave_hull: alpha must be positive");
  planar_region found;
  Eigen::MatrixXd flat = points.places;
  if (flat.rows() == 3) {
    const auto view = flattened(points.places, options.tolerance, "concave_hull");
    flat = view.places;
    found.normal = view.normal;
    found.offset = view.normal.dot(view.middle + origin);
    found.thickness = view.thickness;
  } else {
    expects(options.tolerance == 0, "concave_hull: points in the plane take no tolerance");
  }
  const auto mesh = triangulate({flat, {}, points.epsilon});
  const auto corner = [&](index_t k, index_t t) -> Eigen::Vector2d {
    return flat.col(mesh.simplices(k, t));
  };
  std::vector<bool> chosen(mesh.simplices.cols()), used(flat.cols());
  std::vector<Eigen::Vector3i> triangles;
  for (index_t t = 0; t < mesh.simplices.cols(); ++t) {
    const Eigen::Vector2d a = corner(0, t), b = corner(1, t), c = corner(2, t);
    chosen[t] = std::isinf(options.alpha) || circumradius(a, b, c) <= options.alpha;
    if (!chosen[t]) continue;
    const Eigen::Vector2d ab = b - a, ac = c - a;
    found.area += (ab[0] * ac[1] - ab[1] * ac[0]) / 2;
    Eigen::Vector3i triangle;
    for (int k = 0; k < 3; ++k) {
      used[mesh.simplices(k, t)] = true;
      triangle[k] = points.indices[mesh.simplices(k, t)];
    }
    triangles.push_back(triangle);
  }
  found.triangles.resize(3, std::ssize(triangles));
  for (index_t t = 0; t < found.triangles.cols(); ++t) found.triangles.col(t) = triangles[t];
  found.left_out = flat.cols() - std::ranges::count(used, true);
  for (const auto& ring : rings_about(mesh.simplices, mesh.neighbors, chosen)) {
    auto& named = found.rings.emplace_back();
    for (std::size_t k = 0; k < ring.size(); ++k) {
      named.push_back(points.indices[ring[k]]);
      found.perimeter += (flat.col(ring[(k + 1) % ring.size()]) - flat.col(ring[k])).norm();
    }
  }
  return found;
}

}  // namespace cilantro
