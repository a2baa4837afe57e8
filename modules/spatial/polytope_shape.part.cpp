// SPDX-License-Identifier: MIT
//
// What is common to hulls of points and to intersections of half-spaces: facets in canonical order,
// rings, neighbours, measures, and the way from a subspace back into all of space.
module;
#include <algorithm>
#include <cmath>
#include <compare>
#include <cstdint>
#include <iterator>
#include <limits>
#include <numeric>
#include <ranges>
#include <span>
#include <utility>
#include <vector>
module cilantro.spatial:polytope_shape;

import cilantro.core;
import cilantro.eigen;
import :polytope_data;

namespace cilantro {

/// An affine subspace: the points origin + basis · y. The columns of the basis are orthonormal.
struct affine_subspace {
  Eigen::VectorXd origin;
  Eigen::MatrixXd basis;
};

/// A polytope that is as wide as the space of its coordinates has dimensions.
struct polytope_shape {
  Eigen::MatrixXd vertices, rays, normals;
  Eigen::VectorXd offsets;
  /// Vertices of each facet; ray r is counted as vertices.cols() + r.
  lists_of_indices facets;
  lists_of_indices neighbors;
  index_list simplices;
  index_list indices;
};

/// The chosen columns, or entries.
template <class Indices>
Eigen::MatrixXd columns_of(const Eigen::MatrixXd& all, const Indices& which) {
  Eigen::MatrixXd some(all.rows(), std::ssize(which));
  for (index_t k = 0; k < some.cols(); ++k) some.col(k) = all.col(which[k]);
  return some;
}
template <class Indices>
Eigen::VectorXd entries_of(const Eigen::VectorXd& all, const Indices& which) {
  Eigen::VectorXd some(std::ssize(which));
  for (index_t k = 0; k < some.size(); ++k) some[k] = all[which[k]];
  return some;
}

/// An orthonormal basis of the span of the columns, the longest remainder first, until none is
/// longer than `negligible` (Gram and Schmidt, twice for accuracy).
Eigen::MatrixXd span_of(Eigen::MatrixXd columns, double negligible) {
  const index_t d = columns.rows();
  Eigen::MatrixXd basis(d, 0);
  while (basis.cols() < d && columns.cols() > 0) {
    index_t longest = 0;
    const double length = std::sqrt(columns.colwise().squaredNorm().maxCoeff(&longest));
    if (!(length > negligible)) break;
    Eigen::VectorXd next = columns.col(longest) / length;
    next -= basis * (basis.transpose() * next);
    next.normalize();
    basis.conservativeResize(d, basis.cols() + 1);
    basis.rightCols(1) = next;
    columns -= next * (next.transpose() * columns);
  }
  return basis;
}
/// An orthonormal basis of what is orthogonal to all columns of an orthonormal one.
Eigen::MatrixXd complement_of(const Eigen::MatrixXd& basis) {
  const index_t d = basis.rows();
  Eigen::MatrixXd rest = Eigen::MatrixXd::Identity(d, d);
  for (int twice = 0; twice < 2; ++twice) rest -= basis * (basis.transpose() * rest);
  Eigen::MatrixXd complement = span_of(rest, 1e-6);
  complement -= basis * (basis.transpose() * complement);
  return complement;
}

namespace {

/// The determinant of a small matrix, by elimination with partial pivoting.
double determinant_of(Eigen::MatrixXd m) {
  double product = 1;
  for (index_t k = 0; k < m.rows(); ++k) {
    index_t pivot = k;
    m.col(k).tail(m.rows() - k).cwiseAbs().maxCoeff(&pivot);
    pivot += k;
    if (m(pivot, k) == 0) return 0;
    if (pivot != k) {
      m.row(k).swap(m.row(pivot));
      product = -product;
    }
    product *= m(k, k);
    for (index_t i = k + 1; i < m.rows(); ++i) m.row(i) -= m(i, k) / m(k, k) * m.row(k);
  }
  return product;
}

/// Orders the vertices of a facet in three dimensions counterclockwise, as seen from outside, the
/// smallest first. They are in ascending order before.
void order_ring(const polytope_shape& shape, index_t facet, std::span<std::int32_t> ring) {
  const Eigen::Vector3d normal = shape.normals.col(facet);
  if (ring.size() == 3) {
    const Eigen::Vector3d first = shape.vertices.col(ring[0]);
    const Eigen::Vector3d a = shape.vertices.col(ring[1]) - first;
    const Eigen::Vector3d b = shape.vertices.col(ring[2]) - first;
    if (a.cross(b).dot(normal) < 0) std::swap(ring[1], ring[2]);
    return;
  }
  Eigen::Index least = 0;
  normal.cwiseAbs().minCoeff(&least);
  const Eigen::Vector3d u = normal.cross(Eigen::Vector3d::Unit(least)).normalized();
  const Eigen::Vector3d v = normal.cross(u);
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const auto i : ring) middle += shape.vertices.col(i);
  middle /= double(ring.size());
  std::vector<std::pair<double, std::int32_t>> turned;
  for (const auto i : ring) {
    const Eigen::Vector3d arm = shape.vertices.col(i) - middle;
    turned.push_back({std::atan2(v.dot(arm), u.dot(arm)), i});
  }
  std::ranges::sort(turned);
  const auto first = std::ranges::min_element(turned, {}, [](const auto& t) { return t.second; });
  std::ranges::rotate(turned, first);
  std::ranges::transform(turned, ring.begin(), [](const auto& t) { return t.second; });
}

/// Facets by their vertices in ascending order, so that nothing depends on who found them first.
void order_facets(polytope_shape& shape) {
  const index_t count = shape.facets.size();
  lists_of_indices sorted = shape.facets;
  for (index_t f = 0; f < count; ++f) std::ranges::sort(sorted[f]);
  std::vector<std::int32_t> order(count), place(count);
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, [&](auto a, auto b) {
    return std::ranges::lexicographical_compare(sorted[a], sorted[b]);
  });
  for (index_t k = 0; k < count; ++k) place[order[k]] = static_cast<std::int32_t>(k);

  lists_of_indices facets, neighbors;
  Eigen::MatrixXd normals(shape.normals.rows(), count);
  Eigen::VectorXd offsets(count);
  for (index_t k = 0; k < count; ++k) {
    normals.col(k) = shape.normals.col(order[k]);
    offsets[k] = shape.offsets[order[k]];
    facets.values.insert(facets.values.end(), sorted[order[k]].begin(), sorted[order[k]].end());
    facets.close();
    if (shape.neighbors.size() != count) continue;
    const auto begin = std::ssize(neighbors.values);
    for (const auto n : std::as_const(shape.neighbors)[order[k]])
      neighbors.values.push_back(place[n]);
    std::ranges::sort(neighbors.values.begin() + begin, neighbors.values.end());
    neighbors.close();
  }
  shape.normals = std::move(normals);
  shape.offsets = std::move(offsets);
  shape.facets = std::move(facets);
  shape.neighbors = std::move(neighbors);
}

/// Which facets meet at an edge, where facets are rings.
void find_neighbors_of_rings(polytope_shape& shape) {
  struct edge {
    std::int32_t low, high, place, facet;
    auto operator<=>(const edge&) const = default;
  };
  std::vector<edge> edges;
  edges.reserve(shape.facets.values.size());
  for (index_t f = 0; f < shape.facets.size(); ++f) {
    const auto ring = std::as_const(shape.facets)[f];
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const auto [low, high] = std::minmax(ring[k], ring[(k + 1) % ring.size()]);
      edges.push_back({low, high, static_cast<std::int32_t>(shape.facets.begins[f] + k),
                       static_cast<std::int32_t>(f)});
    }
  }
  std::ranges::sort(edges);
  shape.neighbors.begins = shape.facets.begins;
  shape.neighbors.values.assign(edges.size(), 0);
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const auto same = [&](std::size_t other) {
      return edges[k].low == edges[other].low && edges[k].high == edges[other].high;
    };
    std::size_t across = k;
    if (k > 0 && same(k - 1)) across = k - 1;
    if (k + 1 < edges.size() && same(k + 1)) across = k + 1;
    shape.neighbors.values[edges[k].place] = edges[across].facet;
  }
}

/// Whether the vertices and rays that two facets share span a face of two dimensions less than the
/// polytope.
bool share_ridge(const polytope_shape& shape, std::int32_t f, std::int32_t g) {
  const index_t d = shape.normals.rows(), corners = shape.vertices.cols();
  std::vector<std::int32_t> common;
  std::ranges::set_intersection(shape.facets[f], shape.facets[g], std::back_inserter(common));
  if (std::ssize(common) < d - 1 || common.front() >= corners) return false;
  Eigen::MatrixXd arms(d, std::ssize(common) - 1);
  for (index_t k = 0; k < arms.cols(); ++k) {
    const auto next = common[k + 1];
    if (next < corners)
      arms.col(k) = (shape.vertices.col(next) - shape.vertices.col(common[0])).normalized();
    else
      arms.col(k) = shape.rays.col(next - corners);
  }
  return span_of(arms, 1e-9).cols() == d - 2;
}

/// Which facets are neighbours, from the vertices and rays that they share. Where no more facets
/// meet than must, each two of them are.
void find_neighbors_at_corners(polytope_shape& shape) {
  const index_t d = shape.normals.rows(), corners = shape.vertices.cols();
  std::vector<std::vector<std::int32_t>> meeting(corners + shape.rays.cols());
  for (index_t f = 0; f < shape.facets.size(); ++f)
    for (const auto g : std::as_const(shape.facets)[f])
      meeting[g].push_back(static_cast<std::int32_t>(f));
  using pair = std::pair<std::int32_t, std::int32_t>;
  std::vector<pair> neighbors, candidates;
  for (index_t g = 0; g < std::ssize(meeting); ++g) {
    const bool is_simple = std::ssize(meeting[g]) <= (g < corners ? d : d - 1);
    auto& list = is_simple ? neighbors : candidates;
    for (const auto a : meeting[g])
      for (const auto b : meeting[g])
        if (a != b) list.push_back({a, b});
  }
  const auto unique = [](std::vector<pair>& list) {
    std::ranges::sort(list);
    list.erase(std::ranges::unique(list).begin(), list.end());
  };
  unique(candidates);
  for (const auto& [a, b] : candidates)
    if (share_ridge(shape, a, b)) neighbors.push_back({a, b});
  unique(neighbors);
  shape.neighbors = {};
  auto next = neighbors.begin();
  for (index_t f = 0; f < shape.facets.size(); ++f) {
    for (; next != neighbors.end() && next->first == f; ++next)
      shape.neighbors.values.push_back(next->second);
    shape.neighbors.close();
  }
}

/// Which simplices share all vertices but one.
void find_neighbors_of_simplices(polytope_shape& shape) {
  struct ridge {
    std::vector<std::int32_t> vertices;
    std::int32_t facet;
    auto operator<=>(const ridge&) const = default;
  };
  std::vector<ridge> ridges;
  for (index_t f = 0; f < shape.facets.size(); ++f) {
    const auto all = std::as_const(shape.facets)[f];
    for (const auto left_out : all) {
      ridge next{{}, static_cast<std::int32_t>(f)};
      for (const auto v : all)
        if (v != left_out) next.vertices.push_back(v);
      ridges.push_back(std::move(next));
    }
  }
  std::ranges::sort(ridges);
  std::vector<std::vector<std::int32_t>> across(shape.facets.size());
  for (std::size_t k = 1; k < ridges.size(); ++k)
    if (ridges[k].vertices == ridges[k - 1].vertices) {
      across[ridges[k].facet].push_back(ridges[k - 1].facet);
      across[ridges[k - 1].facet].push_back(ridges[k].facet);
    }
  shape.neighbors = {};
  for (auto& list : across) {
    std::ranges::sort(list);
    shape.neighbors.values.insert(shape.neighbors.values.end(), list.begin(), list.end());
    shape.neighbors.close();
  }
}

/// The planes through the vertices of facets in two and three dimensions.
void refit_planes(polytope_shape& shape) {
  for (index_t f = 0; f < shape.facets.size(); ++f) {
    const auto ring = std::as_const(shape.facets)[f];
    const Eigen::VectorXd given = shape.normals.col(f), corner = shape.vertices.col(ring[0]);
    Eigen::VectorXd normal = given;
    if (corner.size() == 2) {
      const Eigen::Vector2d edge = shape.vertices.col(ring[1]) - corner;
      normal = Eigen::Vector2d{edge[1], -edge[0]};
    } else if (corner.size() == 3) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (std::size_t k = 2; k < ring.size(); ++k) {
        const Eigen::Vector3d a = shape.vertices.col(ring[k - 1]) - corner;
        const Eigen::Vector3d b = shape.vertices.col(ring[k]) - corner;
        sum += a.cross(b);
      }
      normal = sum;
    }
    const double length = normal.norm();
    if (length > 0) normal /= length;
    if (normal.dot(given) < 0) normal = -normal;
    // A sliver has no plane of its own to speak of.
    if (!(normal.dot(given) > 0.5)) normal = given;
    shape.normals.col(f) = normal;
    shape.offsets[f] = -std::numeric_limits<double>::infinity();
    for (const auto v : ring)
      shape.offsets[f] = std::max(shape.offsets[f], normal.dot(shape.vertices.col(v)));
  }
}

double factorial(index_t n) {
  return n < 2 ? 1 : double(n) * factorial(n - 1);
}

/// Volume, area and centroid, from cones over the simplices of the boundary.
template <int D>
void measure(const polytope_shape& shape, polytope_data& out) {
  const index_t d = shape.vertices.rows();
  const point_vector<double, D> middle = shape.vertices.rowwise().mean();
  // In units of about its size, so that products of huge or tiny numbers stay in range.
  const double size = (shape.vertices.colwise() - Eigen::VectorXd{middle}).cwiseAbs().maxCoeff();
  int exponent = 0;
  std::frexp(size, &exponent);
  const double unit = size > 0 ? std::ldexp(1.0, exponent) : 1;
  point_vector<double, D> moment = 0 * middle;
  Eigen::Matrix<double, D, D> arms(d, d);
  double volume = 0, area = 0;
  for (std::size_t s = 0; s < shape.simplices.size(); s += d) {
    for (index_t k = 0; k < d; ++k)
      arms.col(k) = (shape.vertices.col(shape.simplices[s + k]) - middle) / unit;
    double cone = 0, base = 0;
    if constexpr (D == 3) {
      const Eigen::Vector3d a = arms.col(1) - arms.col(0), b = arms.col(2) - arms.col(0);
      const Eigen::Vector3d across = a.cross(b);
      cone = std::abs(across.dot(arms.col(0)));
      base = across.norm();
    } else {
      cone = std::abs(determinant_of(arms));
      const Eigen::MatrixXd edges = arms.rightCols(d - 1).colwise() - arms.col(0);
      base = std::sqrt(std::max(0.0, determinant_of(edges.transpose() * edges)));
    }
    volume += cone;
    area += base;
    moment += cone * arms.rowwise().sum();
  }
  const auto scaled = [&](double sum, index_t power) {
    return sum > 0 ? sum / factorial(power) * std::pow(unit, double(power)) : 0;
  };
  out.measure = scaled(volume, d);
  out.area = scaled(area, d - 1);
  out.centroid = middle;
  if (volume > 0) out.centroid += moment / (volume * double(d + 1)) * unit;
}

}  // namespace

/// Brings facets into their canonical order and form. In three dimensions and bounded, each becomes
/// a ring, and with `simplicial` rings are cut into triangles. With `refit`, planes in two and
/// three dimensions are those through the vertices, so that they do not depend on how these were
/// found.
void arrange(polytope_shape& shape, bool refit, bool simplicial) {
  const index_t d = shape.normals.rows();
  const bool bounded = shape.rays.cols() == 0;
  order_facets(shape);
  if (d == 3 && bounded) {
    for (index_t f = 0; f < shape.facets.size(); ++f) order_ring(shape, f, shape.facets[f]);
    if (refit) refit_planes(shape);
    shape.simplices.clear();
    lists_of_indices triangles;
    std::vector<std::int32_t> whole;
    for (index_t f = 0; f < shape.facets.size(); ++f) {
      const auto ring = std::as_const(shape.facets)[f];
      for (std::size_t k = 2; k < ring.size(); ++k) {
        shape.simplices.insert(shape.simplices.end(), {ring[0], ring[k - 1], ring[k]});
        triangles.values.insert(triangles.values.end(), {ring[0], ring[k - 1], ring[k]});
        triangles.close();
        whole.push_back(static_cast<std::int32_t>(f));
      }
    }
    if (simplicial) {
      shape.facets = std::move(triangles);
      shape.normals = columns_of(shape.normals, whole);
      shape.offsets = entries_of(shape.offsets, whole);
    }
    find_neighbors_of_rings(shape);
  } else if (d <= 2 && bounded) {
    if (refit) refit_planes(shape);
    shape.simplices = shape.facets.values;
  }
  if (shape.neighbors.size() == shape.facets.size()) return;
  if (bounded && simplicial)
    find_neighbors_of_simplices(shape);
  else
    find_neighbors_at_corners(shape);
}

/// The polytope in all of space.
polytope_data embed(polytope_shape shape, const affine_subspace& within) {
  polytope_data out;
  const index_t d = within.basis.rows(), k = within.basis.cols();
  out.dimension = d;
  out.affine_dimension = k;
  out.bounded = shape.rays.cols() == 0;
  const bool everywhere = k == d;
  if (out.bounded) {
    if (k == 0) {
      out.measure = 1;
      out.centroid = within.origin;
    } else {
      if (k == 3)
        measure<3>(shape, out);
      else
        measure<dynamic>(shape, out);
      out.centroid = within.origin + within.basis * out.centroid;
    }
  } else {
    out.measure = out.area = std::numeric_limits<double>::infinity();
  }
  const Eigen::MatrixXd across = everywhere ? Eigen::MatrixXd(d, 0) : complement_of(within.basis);
  const index_t facets = shape.facets.size(), flat = across.cols();
  out.vertices = (within.basis * shape.vertices).colwise() + within.origin;
  out.rays = within.basis * shape.rays;
  out.normals.resize(d, facets + 2 * flat);
  out.offsets.resize(facets + 2 * flat);
  out.normals.leftCols(facets) = within.basis * shape.normals;
  out.offsets.head(facets) = shape.offsets;
  for (index_t f = 0; f < facets; ++f) out.offsets[f] += out.normals.col(f).dot(within.origin);
  for (index_t j = 0; j < flat; ++j) {
    const double place = across.col(j).dot(within.origin);
    out.normals.col(facets + 2 * j) = across.col(j);
    out.offsets[facets + 2 * j] = place;
    out.normals.col(facets + 2 * j + 1) = -across.col(j);
    out.offsets[facets + 2 * j + 1] = -place;
  }
  out.indices = std::move(shape.indices);
  out.facets = std::move(shape.facets);
  out.neighbors = std::move(shape.neighbors);
  out.simplices = std::move(shape.simplices);
  return out;
}

/// How far the farthest of some points is outside a bounded shape; 0 if none is.
///
/// The facet that a point is farthest outside of, in units of the facet's distance from the middle,
/// is the vertex of the dual polytope that is farthest in the direction of the point: it is found
/// from facet to neighbouring facet, uphill. Vertices start at a facet of their own, others where
/// the last one ended.
double farthest_outside(const polytope_shape& shape, const Eigen::MatrixXd& points) {
  const index_t d = points.rows(), count = shape.facets.size();
  // Where few numbers are compared, all are: facets that are nearly in one plane may have a false
  // summit between them.
  if (points.cols() * count <= 250'000)
    return std::max(0.0,
                    ((shape.normals.transpose() * points).colwise() - shape.offsets).maxCoeff());
  const Eigen::VectorXd middle = shape.vertices.rowwise().mean();
  // Facets as dual points.
  Eigen::MatrixXd dual = shape.normals;
  for (index_t f = 0; f < count; ++f) {
    const double distance = shape.offsets[f] - shape.normals.col(f).dot(middle);
    if (!(distance > 0)) return std::numeric_limits<double>::infinity();
    dual.col(f) /= distance;
  }
  std::vector<std::int32_t> facet_of(points.cols(), -1);
  for (index_t f = 0; f < count; ++f)
    for (const auto v : shape.facets[f]) facet_of[shape.indices[v]] = static_cast<std::int32_t>(f);
  double farthest = 0;
  index_t at = 0;
  for (index_t i = 0; i < points.cols(); ++i) {
    const double* point = points.col(i).data();
    const auto height = [&](index_t f) {
      const double* facet = dual.col(f).data();
      double sum = 0;
      for (index_t k = 0; k < d; ++k) sum += facet[k] * (point[k] - middle[k]);
      return sum;
    };
    if (facet_of[i] >= 0) at = facet_of[i];
    double highest = height(at);
    for (bool climbs = true; climbs;) {
      climbs = false;
      for (const auto n : shape.neighbors[at])
        if (const double other = height(n); other > highest) {
          highest = other;
          at = n;
          climbs = true;
          break;
        }
    }
    if (highest > 1)
      farthest = std::max(farthest, shape.normals.col(at).dot(points.col(i)) - shape.offsets[at]);
  }
  return farthest;
}

/// Moves the polytope.
void translate(polytope_data& moved, const Eigen::VectorXd& by) {
  if (by.size() == 0 || by.isZero(0)) return;
  moved.vertices.colwise() += by;
  moved.offsets += moved.normals.transpose() * by;
  if (moved.centroid.size() > 0) moved.centroid += by;
  moved.tolerance += 64 * std::numeric_limits<double>::epsilon() * by.cwiseAbs().maxCoeff();
}

}  // namespace cilantro
