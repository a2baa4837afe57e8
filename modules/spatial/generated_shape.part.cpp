// SPDX-License-Identifier: MIT
//
// From what generates a set to its shape, verified.
module cilantro.spatial:generated_shape;

import cilantro.standard;
import cilantro.core;
import cilantro.eigen;
import :generated_set;
import :generators;
import :polytope_data;
import :polytope_shape;
import :pulling;

namespace cilantro {

/// A shape, and the distance within which it holds; corners that are far away, within their
/// rounding if that is more.
struct verified_shape {
  polytope_shape shape;
  double tolerance;
};

namespace {

/// Which lists of corners, ascending, are part of no other one.
std::vector<index_t> largest_of(const lists_of_indices& lists) {
  std::vector<index_t> largest;
  for (index_t f = 0; f < lists.size(); ++f) {
    bool is_largest = true;
    for (index_t g = 0; g < lists.size() && is_largest; ++g)
      is_largest = g == f || lists[g].size() < lists[f].size() ||
                   (lists[g].size() == lists[f].size() && g > f) ||
                   !std::ranges::includes(lists[g], lists[f]);
    if (is_largest) largest.push_back(f);
  }
  return largest;
}

/// The planes with enough generators to be facets, and their generators by their place in `order`;
/// one more than there are stands for that at infinity.
struct facet_lists {
  lists_of_indices members;
  std::vector<index_t> planes;
};
facet_lists facets_of(const generated_set& set, const std::vector<index_t>& order, index_t width) {
  facet_lists found;
  const index_t planes = set.planes().cols();
  found.members.values.reserve((width + 1) * set.size());
  found.members.begins.reserve(planes + 2);
  found.planes.reserve(planes + 1);
  for (index_t f = 0; f <= planes; ++f) {
    const index_t plane = f < planes ? f + 1 : 0;
    const auto before = std::ssize(found.members.values);
    for (index_t k = 0; k < set.size(); ++k)
      if (set.lies_on(order[k], plane))
        found.members.values.push_back(static_cast<std::int32_t>(k));
    const bool is_finite = plane == 0 || (std::ssize(found.members.values) > before &&
                                          !set.is_ray(order[found.members.values[before]]));
    if (is_finite && std::ssize(found.members.values) - before >= width) {
      found.members.close();
      found.planes.push_back(f);
    } else {
      found.members.values.resize(before);
    }
  }
  // In higher dimensions, planes that hold but a face of less dimensions may have as many.
  if (width <= 3) return found;
  facet_lists some;
  for (const auto f : largest_of(found.members)) {
    const auto list = std::as_const(found.members)[f];
    some.members.values.insert(some.members.values.end(), list.begin(), list.end());
    some.members.close();
    some.planes.push_back(found.planes[f]);
  }
  return some;
}

constexpr double most_slope = generated_set::nearby * generated_set::negligible_slope;

/// Whether no ray goes out of a plane that it is said to lie on, nor through that of a facet.
bool rays_hold(const polytope_shape& shape) {
  const index_t corners = shape.vertices.cols();
  if (shape.rays.cols() == 0) return true;
  for (index_t f = 0; f < shape.facets.size(); ++f) {
    const auto normal = shape.normals.col(f).transpose();
    if (!((normal * shape.rays).maxCoeff() <= most_slope)) return false;
    for (const auto g : shape.facets[f])
      if (g >= corners && !(normal.dot(shape.rays.col(g - corners)) >= -most_slope)) return false;
  }
  return true;
}
/// How far a corner is outside of any plane, or from one that it lies on, as a multiple of what it
/// may be, or 0 if none by more than the tolerance. That of planes without a facet tells where
/// planes that are nearly parallel have been taken for another order than theirs.
double worst_of(const generated_set& set, double tolerance) {
  const index_t d = set.dimension();
  const auto planes = set.planes();
  double worst = 0;
  for (index_t g = 0; g < set.size(); ++g) {
    const double* x = set.generator(g);
    const double* plane = planes.data();
    double most = 0;
    for (index_t f = 0; f < planes.cols(); ++f, plane += d + 1) {
      double height = -plane[d] * x[d];
      for (index_t k = 0; k < d; ++k) height += plane[k] * x[k];
      if (height > 0 || set.lies_on(g, f + 1)) most = std::max(most, std::abs(height));
    }
    if (most > tolerance || set.is_ray(g))
      worst = std::max(worst, most / set.tolerance_at(x, tolerance));
  }
  return worst;
}

}  // namespace

/// Whether the facets of a set without lines close up, those that are unbounded at infinity, and
/// rays lie on the planes that they are said to lie on. Facets are ascending.
bool closes_up(const polytope_shape& shape) {
  const index_t d = shape.vertices.rows(), corners = shape.vertices.cols();
  if (shape.rays.cols() == 0) return closes_up(shape.simplices, d);
  if (!rays_hold(shape)) return false;
  lists_of_indices all = shape.facets;
  index_list far(shape.rays.cols());
  std::iota(far.begin(), far.end(), static_cast<std::int32_t>(corners));
  bool is_facet = std::ssize(far) >= d;
  for (index_t f = 0; f < shape.facets.size() && is_facet; ++f)
    is_facet = !std::ranges::includes(shape.facets[f], far);
  if (is_facet) {
    all.values.insert(all.values.end(), far.begin(), far.end());
    all.close();
  }
  return closes_up(pulled_boundary(all, d).corners, d);
}

/// Nothing if the generators do not make a polytope: if they are not on their planes within the
/// tolerance or what rounding makes of that, or if facets do not close up.
std::optional<verified_shape> verified_shape_of(const generated_set& set, double tolerance) {
  const index_t d = set.dimension(), lines = set.lines().cols(), width = d - lines;
  if (set.size() == 0 || !set.has_edges()) return {};
  std::vector<index_t> order(set.size());
  for (index_t g = 0; g < set.size(); ++g) {
    if (set.plane_count_of(g) < width) return {};
    order[g] = g;
  }
  std::ranges::sort(order, [&](auto a, auto b) {
    if (set.is_ray(a) != set.is_ray(b)) return set.is_ray(b);
    return std::lexicographical_compare(set.generator(a), set.generator(a) + d, set.generator(b),
                                        set.generator(b) + d);
  });
  const index_t corners = std::ranges::count_if(order, [&](auto g) { return !set.is_ray(g); });
  if (corners == 0) return {};
  const bool bounded = corners == set.size() && lines == 0;

  const double worst = worst_of(set, tolerance);
  if (!(worst <= generated_set::nearby)) return {};
  const auto planes = set.planes();
  auto [members, facets] = facets_of(set, order, width);
  const bool closed = width <= 1 || (d <= 3 && bounded) ||
                      closes_up(pulled_boundary(members, width).corners, width);
  if (!closed) return {};
  polytope_shape shape;
  if (!facets.empty() && facets.back() == planes.cols()) {
    facets.pop_back();
    members.begins.pop_back();
    members.values.resize(members.begins.back());
  }
  if (lines == 0) {
    shape.facets = std::move(members);
  } else {
    for (index_t f = 0; f < std::ssize(facets); ++f) {
      const auto list = std::as_const(members)[f];
      shape.facets.values.insert(shape.facets.values.end(), list.begin(), list.end());
      for (index_t r = 0; r < 2 * lines; ++r)
        shape.facets.values.push_back(static_cast<std::int32_t>(set.size() + r));
      shape.facets.close();
    }
  }
  shape.vertices.resize(d, corners);
  shape.rays.resize(d, set.size() - corners + 2 * lines);
  for (index_t k = 0; k < set.size(); ++k)
    (k < corners ? shape.vertices.col(k) : shape.rays.col(k - corners)) =
        Eigen::VectorXd::Map(set.generator(order[k]), d);
  shape.rays.rightCols(2 * lines) << set.lines(), -set.lines();
  shape.normals = columns_of(planes.topRows(d), facets);
  // A matrix without columns has no row to look at.
  if (!facets.empty()) shape.offsets = entries_of(planes.row(d).transpose(), facets);

  if (bounded && shape.facets.size() <= d) return {};
  // In space, facets close up if Euler's count is right.
  if (d == 3 && bounded &&
      2 * (corners + shape.facets.size() - 2) != std::ssize(shape.facets.values))
    return {};
  arrange(shape, false, false);
  return verified_shape{std::move(shape), tolerance * std::max(worst, 1.0)};
}

}  // namespace cilantro
