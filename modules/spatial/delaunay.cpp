// SPDX-License-Identifier: MIT
module cilantro.spatial;

import :polytope_shape;
import :pulling;

namespace cilantro {
namespace {

using simplex_table = Eigen::Matrix<std::int32_t, dynamic, dynamic>;

constexpr const char* not_verified =
    "delaunay_triangulation: the simplices do not fill the hull side by side; points may be too "
    "near to each other for their distance from the others, which voxel_downsample mends";

/// The simplices of the lower side of the hull of lifted points, by the hull's vertices.
index_list lower_simplices(const convex_polytope<>& lifted, index_t d) {
  // Steeper facets belong to slivers at the boundary that are thinner than rounding.
  constexpr double steep = -1e-9;
  const auto& hull = lifted.data();
  std::vector<index_list> facets(hull.facets.size());
  for (index_t f = 0; f < std::ssize(facets); ++f) {
    facets[f].assign(hull.facets[f].begin(), hull.facets[f].end());
    std::ranges::sort(facets[f]);
  }
  index_list prefix, simplices;
  if (hull.affine_dimension == d) {
    // All points on one sphere, unless they are in a plane.
    if (std::abs(hull.normals(d, hull.normals.cols() - 1)) < -steep) return {};
    index_list all(hull.vertices.cols());
    std::iota(all.begin(), all.end(), 0);
    pull(all, facets, d, prefix, simplices);
    return simplices;
  }
  for (index_t f = 0; f < std::ssize(facets); ++f) {
    if (!(hull.normals(d, f) < steep)) continue;
    std::vector<index_list> ridges;
    if (std::ssize(facets[f]) > d + 1)
      for (const auto n : hull.neighbors[f]) {
        index_list common;
        std::ranges::set_intersection(facets[f], facets[n], std::back_inserter(common));
        if (std::ssize(common) >= d) ridges.push_back(std::move(common));
      }
    std::ranges::sort(ridges);
    ridges.erase(std::ranges::unique(ridges).begin(), ridges.end());
    pull(facets[f], ridges, d, prefix, simplices);
  }
  return simplices;
}

/// The volume of a simplex, positive if it is oriented so, times the factorial of the dimension.
double oriented_volume(const Eigen::MatrixXd& points, std::span<const std::int32_t> corners) {
  const auto arm = [&](int k) -> Eigen::VectorXd {
    return points.col(corners[k]) - points.col(corners[0]);
  };
  if (points.rows() == 2) {
    const Eigen::Vector2d a = arm(1), b = arm(2);
    return a[0] * b[1] - a[1] * b[0];
  }
  const Eigen::Vector3d a = arm(1), b = arm(2), c = arm(3);
  return a.cross(b).dot(c);
}

struct face {
  std::array<std::int32_t, 3> corners;  ///< Ascending; the first is −1 in 2D.
  bool is_even;  ///< Whether that is an even permutation of how its simplex turns it outwards.
  index_t opposite;
};

/// The face that is opposite to corner k of simplex s.
face face_of(const simplex_table& simplices, index_t s, index_t k) {
  face found{.corners = {-1, -1, -1}, .is_even = k % 2 == 0, .opposite = s * simplices.rows() + k};
  index_t at = 4 - simplices.rows();
  for (index_t j = 0; j < simplices.rows(); ++j)
    if (j != k) found.corners[at++] = simplices(j, s);
  for (int i = 1; i < 3; ++i)
    for (int j = i; j > 0 && found.corners[j] < found.corners[j - 1]; --j) {
      std::swap(found.corners[j], found.corners[j - 1]);
      found.is_even = !found.is_even;
    }
  return found;
}

/// For each corner of each simplex, the other one that has all corners but this; nothing if there
/// are several, or if the two are on the same side of the face that they share.
std::optional<simplex_table> neighbors_of(const simplex_table& simplices) {
  std::vector<face> faces;
  faces.reserve(simplices.size());
  for (index_t s = 0; s < simplices.cols(); ++s)
    for (index_t k = 0; k < simplices.rows(); ++k) faces.push_back(face_of(simplices, s, k));
  std::ranges::sort(faces, [](const face& a, const face& b) {
    return a.corners != b.corners ? a.corners < b.corners : a.opposite < b.opposite;
  });
  simplex_table neighbors(simplices.rows(), simplices.cols());
  neighbors.setConstant(-1);
  for (std::size_t i = 1; i < faces.size(); ++i) {
    const auto &a = faces[i - 1], &b = faces[i];
    if (a.corners != b.corners) continue;
    if (neighbors.data()[a.opposite] >= 0 || a.is_even == b.is_even) return {};
    neighbors.data()[a.opposite] = static_cast<std::int32_t>(b.opposite / simplices.rows());
    neighbors.data()[b.opposite] = static_cast<std::int32_t>(a.opposite / simplices.rows());
  }
  return neighbors;
}

}  // namespace

triangulation_data triangulate(const finite_points& points) {
  const index_t d = points.places.rows(), count = points.places.cols();
  triangulation_data result;
  result.simplices.resize(d + 1, 0);
  result.neighbors.resize(d + 1, 0);
  if (count <= d) return result;
  const auto moved = centered(points.places);
  const Eigen::MatrixXd& places = moved.places;
  // As flat as what the scalar of the points explains.
  const double flat =
      std::ldexp(4 * points.epsilon * points.places.cwiseAbs().maxCoeff(), -moved.exponent);
  const auto outline = convex_hull(places, {.tolerance = flat});
  if (outline.affine_dimension() < d) return result;
  Eigen::MatrixXd lifted(d + 1, count);
  lifted << places, places.colwise().squaredNorm();
  const auto hull = convex_hull(lifted, {.cull = false});
  auto corners = lower_simplices(hull, d);
  for (auto& c : corners) c = hull.indices()[c];

  double sum = 0;
  std::vector<std::array<std::int32_t, 4>> simplices;
  for (auto at = corners.begin(); at != corners.end(); at += d + 1) {
    std::array<std::int32_t, 4> simplex{};
    std::copy_n(at, d + 1, simplex.begin());
    const std::span all{simplex.data(), static_cast<std::size_t>(d + 1)};
    const double volume = oriented_volume(places, all);
    sum += std::abs(volume);
    if (volume < 0) std::swap(simplex[d - 1], simplex[d]);
    simplices.push_back(simplex);
  }
  const double whole = outline.volume() * (d == 2 ? 2 : 6);
  if (!(std::abs(sum - whole) <= 1e-8 * whole)) throw std::runtime_error{not_verified};
  std::ranges::sort(simplices);
  result.simplices.resize(d + 1, std::ssize(simplices));
  for (index_t s = 0; s < result.simplices.cols(); ++s)
    for (index_t k = 0; k <= d; ++k) result.simplices(k, s) = simplices[s][k];
  auto neighbors = neighbors_of(result.simplices);
  if (!neighbors) throw std::runtime_error{not_verified};
  result.neighbors = std::move(*neighbors);
  return result;
}

}  // namespace cilantro
