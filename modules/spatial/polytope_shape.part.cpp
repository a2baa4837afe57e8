// SPDX-License-Identifier: MIT
//
// What is common to hulls of points and to intersections of half-spaces: subspaces, and facets in
// canonical order, with rings and neighbours.
module cilantro.spatial:polytope_shape;

import cilantro.standard;
import cilantro.core;
import cilantro.eigen;
import :polytope_data;
import :pulling;

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

/// Points about the middle of their bounding box, in units of a power of two in which coordinates
/// are at most 1, so that products are in range: the point is middle + 2^exponent · place.
struct centered_points {
  Eigen::VectorXd middle;
  Eigen::MatrixXd places;
  int exponent = 0;
};
centered_points centered(const Eigen::MatrixXd& points) {
  centered_points moved;
  moved.middle = points.rowwise().minCoeff() / 2 + points.rowwise().maxCoeff() / 2;
  moved.places = points.colwise() - moved.middle;
  std::frexp(moved.places.cwiseAbs().maxCoeff(), &moved.exponent);
  for (index_t i = 0; i < moved.places.size(); ++i)
    moved.places.data()[i] = std::ldexp(moved.places.data()[i], -moved.exponent);
  return moved;
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

/// The numbers from 0 to below `count` in the order of `before`, of which `key`, from 0 to below
/// `keys`, is what comes first: few have the same, so that little is left to compare.
index_list sorted_by(index_t count, index_t keys, auto key, auto before) {
  std::vector<std::int32_t> begins(keys + 1);
  for (index_t i = 0; i < count; ++i) ++begins[key(i) + 1];
  std::partial_sum(begins.begin(), begins.end(), begins.begin());
  index_list order(count);
  auto next = begins;
  for (index_t i = 0; i < count; ++i) order[next[key(i)]++] = static_cast<std::int32_t>(i);
  for (index_t k = 0; k < keys; ++k)
    std::ranges::sort(order.begin() + begins[k], order.begin() + begins[k + 1], before);
  return order;
}

/// Facets by their vertices in ascending order, so that nothing depends on who found them first.
void order_facets(polytope_shape& shape) {
  const index_t count = shape.facets.size();
  lists_of_indices sorted = shape.facets;
  for (index_t f = 0; f < count; ++f) std::ranges::sort(sorted[f]);
  const auto& all = std::as_const(sorted);
  const auto order = sorted_by(
      count, shape.vertices.cols() + shape.rays.cols(),
      [&](index_t f) { return all[f].empty() ? 0 : all[f].front(); },
      [&](auto a, auto b) { return std::ranges::lexicographical_compare(all[a], all[b]); });
  std::vector<std::int32_t> place(count);
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
  const auto order = sorted_by(
      std::ssize(edges), shape.vertices.cols(), [&](index_t e) { return edges[e].low; },
      [&](auto a, auto b) { return edges[a] < edges[b]; });
  shape.neighbors.begins = shape.facets.begins;
  shape.neighbors.values.assign(edges.size(), 0);
  for (index_t k = 0; k < std::ssize(order); ++k) {
    const auto& here = edges[order[k]];
    const auto same = [&](index_t other) {
      return here.low == edges[order[other]].low && here.high == edges[order[other]].high;
    };
    index_t across = k;
    if (k > 0 && same(k - 1)) across = k - 1;
    if (k + 1 < std::ssize(order) && same(k + 1)) across = k + 1;
    shape.neighbors.values[here.place] = edges[order[across]].facet;
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
  // Along lines, facets meet that are not neighbours.
  const bool has_lines =
      corners > 0 && std::ranges::any_of(meeting.begin(), meeting.begin() + corners,
                                         [&](const auto& list) { return std::ssize(list) < d; });
  for (index_t g = 0; g < std::ssize(meeting); ++g) {
    const bool is_simple = !has_lines && std::ssize(meeting[g]) <= (g < corners ? d : d - 1);
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

/// The planes through the vertices of facets in D dimensions, two or three.
template <int D>
void refit_planes(polytope_shape& shape) {
  using vector = Eigen::Matrix<double, D, 1>;
  const auto vertex = [&](std::int32_t v) -> vector { return shape.vertices.col(v); };
  for (index_t f = 0; f < shape.facets.size(); ++f) {
    const auto ring = std::as_const(shape.facets)[f];
    const vector given = shape.normals.col(f), corner = vertex(ring[0]);
    vector normal = vector::Zero();
    if constexpr (D == 2) {
      const vector edge = vertex(ring[1]) - corner;
      normal << edge[1], -edge[0];
    } else {
      for (std::size_t k = 2; k < ring.size(); ++k)
        normal += (vertex(ring[k - 1]) - corner).cross(vertex(ring[k]) - corner);
    }
    const double length = normal.norm();
    if (length > 0) normal /= length;
    if (normal.dot(given) < 0) normal = -normal;
    // A sliver has no plane of its own to speak of.
    if (!(normal.dot(given) > 0.5)) normal = given;
    shape.normals.col(f) = normal;
    shape.offsets[f] = -std::numeric_limits<double>::infinity();
    for (const auto v : ring) shape.offsets[f] = std::max(shape.offsets[f], normal.dot(vertex(v)));
  }
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
    if (refit) refit_planes<3>(shape);
    shape.simplices.clear();
    std::vector<std::int32_t> whole;
    for (index_t f = 0; f < shape.facets.size(); ++f) {
      const auto ring = std::as_const(shape.facets)[f];
      for (std::size_t k = 2; k < ring.size(); ++k) {
        shape.simplices.insert(shape.simplices.end(), {ring[0], ring[k - 1], ring[k]});
        whole.push_back(static_cast<std::int32_t>(f));
      }
    }
    if (simplicial) {
      shape.facets = {{0}, shape.simplices};
      for (index_t s = 1; s <= std::ssize(whole); ++s)
        shape.facets.begins.push_back(static_cast<std::int32_t>(3 * s));
      shape.normals = columns_of(shape.normals, whole);
      shape.offsets = entries_of(shape.offsets, whole);
    }
    find_neighbors_of_rings(shape);
  } else if (d <= 2 && bounded) {
    if (refit && d == 2) refit_planes<2>(shape);
    shape.simplices = shape.facets.values;
  } else if (bounded) {
    auto pulled = pulled_boundary(shape.facets, d);
    if (simplicial) {
      shape.facets = {{0}, std::move(pulled.corners)};
      for (index_t s = 1; s <= std::ssize(pulled.facets); ++s)
        shape.facets.begins.push_back(static_cast<std::int32_t>(s * d));
      shape.normals = columns_of(shape.normals, pulled.facets);
      shape.offsets = entries_of(shape.offsets, pulled.facets);
      shape.neighbors = {};
      order_facets(shape);
      shape.simplices = shape.facets.values;
    } else {
      shape.simplices = std::move(pulled.corners);
    }
  }
  if (shape.neighbors.size() == shape.facets.size()) return;
  if (bounded && simplicial)
    find_neighbors_of_simplices(shape);
  else
    find_neighbors_at_corners(shape);
}

}  // namespace cilantro
