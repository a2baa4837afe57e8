// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <memory>
#include <numeric>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>
module cilantro.spatial;

namespace cilantro {
namespace {

using corner_list = std::vector<std::int32_t>;

/// About the middle, in units of a power of two in which coordinates are at most 1, so that
/// squares are in range.
Eigen::MatrixXd centered(const Eigen::MatrixXd& points) {
  const Eigen::VectorXd low = points.rowwise().minCoeff(), high = points.rowwise().maxCoeff();
  Eigen::MatrixXd moved = points.colwise() - Eigen::VectorXd{low + (high - low) / 2};
  int exponent = 0;
  std::frexp(moved.cwiseAbs().maxCoeff(), &exponent);
  return moved * std::ldexp(1.0, -exponent);
}

/// Cuts a polytope of dimension k, given by its corners and those of its facets, all ascending,
/// into simplices that all have its first corner. Facets are cut in the same way, so that those of
/// two polytopes that share a facet fit.
void pull(const corner_list& corners, const std::vector<corner_list>& facets, index_t k,
          corner_list& prefix, corner_list& out) {
  if (std::ssize(corners) == k + 1) {
    out.insert(out.end(), prefix.begin(), prefix.end());
    out.insert(out.end(), corners.begin(), corners.end());
    return;
  }
  prefix.push_back(corners[0]);
  for (const auto& facet : facets) {
    if (facet[0] == corners[0]) continue;
    std::vector<corner_list> ridges;
    if (std::ssize(facet) > k)
      for (const auto& other : facets) {
        corner_list common;
        std::ranges::set_intersection(facet, other, std::back_inserter(common));
        if (&other != &facet && std::ssize(common) >= k - 1) ridges.push_back(std::move(common));
      }
    pull(facet, ridges, k - 1, prefix, out);
  }
  prefix.pop_back();
}

/// The simplices of the lower side of the hull of lifted points, by the hull's vertices.
corner_list lower_simplices(const convex_polytope<>& lifted, index_t d) {
  // Steeper facets belong to slivers at the boundary that are thinner than rounding.
  constexpr double steep = -1e-9;
  const auto& hull = lifted.data();
  std::vector<corner_list> facets(hull.facets.size());
  for (index_t f = 0; f < std::ssize(facets); ++f) {
    facets[f].assign(hull.facets[f].begin(), hull.facets[f].end());
    std::ranges::sort(facets[f]);
  }
  corner_list prefix, simplices;
  if (hull.affine_dimension == d) {
    // All points on one sphere, unless they are in a plane.
    if (std::abs(hull.normals(d, hull.normals.cols() - 1)) < -steep) return {};
    corner_list all(hull.vertices.cols());
    std::iota(all.begin(), all.end(), 0);
    pull(all, facets, d, prefix, simplices);
    return simplices;
  }
  for (index_t f = 0; f < std::ssize(facets); ++f) {
    if (!(hull.normals(d, f) < steep)) continue;
    std::vector<corner_list> ridges;
    if (std::ssize(facets[f]) > d + 1)
      for (const auto n : hull.neighbors[f]) {
        corner_list common;
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

/// For each corner of each simplex, the other one that has all corners but this.
Eigen::Matrix<std::int32_t, dynamic, dynamic> neighbors_of(
    const Eigen::Matrix<std::int32_t, dynamic, dynamic>& simplices) {
  struct face {
    std::array<std::int32_t, 3> corners;
    index_t opposite;
  };
  std::vector<face> faces;
  faces.reserve(simplices.size());
  for (index_t s = 0; s < simplices.cols(); ++s)
    for (index_t k = 0; k < simplices.rows(); ++k) {
      face next{.corners = {-1, -1, -1}, .opposite = s * simplices.rows() + k};
      for (index_t j = 0, at = 0; j < simplices.rows(); ++j)
        if (j != k) next.corners[at++] = simplices(j, s);
      std::ranges::sort(next.corners);
      faces.push_back(next);
    }
  std::ranges::sort(faces, [](const face& a, const face& b) {
    return a.corners != b.corners ? a.corners < b.corners : a.opposite < b.opposite;
  });
  Eigen::Matrix<std::int32_t, dynamic, dynamic> neighbors(simplices.rows(), simplices.cols());
  neighbors.setConstant(-1);
  const auto link = [&](index_t from, index_t to) {
    neighbors.data()[from] = static_cast<std::int32_t>(to / simplices.rows());
  };
  for (std::size_t i = 1; i < faces.size(); ++i)
    if (faces[i].corners == faces[i - 1].corners) {
      link(faces[i].opposite, faces[i - 1].opposite);
      link(faces[i - 1].opposite, faces[i].opposite);
    }
  return neighbors;
}

}  // namespace

triangulation_data triangulate(const Eigen::MatrixXd& points) {
  const index_t d = points.rows(), count = points.cols();
  triangulation_data result;
  result.simplices.resize(d + 1, 0);
  result.neighbors.resize(d + 1, 0);
  if (count <= d) return result;
  const Eigen::MatrixXd places = centered(points);
  Eigen::MatrixXd lifted(d + 1, count);
  lifted << places, places.colwise().squaredNorm();
  const auto hull = convex_hull(lifted, {.cull = false});
  if (hull.affine_dimension() < d) return result;
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
  if (simplices.empty()) return result;
  std::ranges::sort(simplices);
  const double whole = convex_hull(places).volume() * (d == 2 ? 2 : 6);
  if (!(std::abs(sum - whole) <= 1e-8 * whole))
    throw std::runtime_error{
        "delaunay_triangulation: the simplices do not fill the hull; points may be too near to "
        "each other for their distance from the others"};
  result.simplices.resize(d + 1, std::ssize(simplices));
  for (index_t s = 0; s < result.simplices.cols(); ++s)
    for (index_t k = 0; k <= d; ++k) result.simplices(k, s) = simplices[s][k];
  result.neighbors = neighbors_of(result.simplices);
  return result;
}

}  // namespace cilantro
