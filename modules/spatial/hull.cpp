// SPDX-License-Identifier: MIT
module;
#include "spatial/qhull.hpp"
module cilantro.spatial;

import :hull_candidates;
import :polytope_measures;
import :polytope_shape;
import :pulling;

namespace cilantro {
namespace {

/// A centre that is subtracted from all points without rounding, or 0: along an axis on which all
/// points are on one side of 0 and within a factor of two, the nearest of them.
Eigen::VectorXd exact_center(const Eigen::MatrixXd& points) {
  const Eigen::VectorXd low = points.rowwise().minCoeff(), high = points.rowwise().maxCoeff();
  Eigen::VectorXd center = Eigen::VectorXd::Zero(points.rows());
  for (index_t d = 0; d < center.size(); ++d) {
    if (low[d] > 0 && high[d] <= 2 * low[d]) center[d] = low[d];
    if (high[d] < 0 && low[d] >= 2 * high[d]) center[d] = high[d];
  }
  return center;
}

/// For points that lie in a hyperplane or less: where the hull is a point, a segment, or found in
/// a subspace.
affine_subspace subspace_of(const Eigen::MatrixXd& points, double negligible) {
  const index_t d = points.rows();
  Eigen::Index first = 0;
  points.row(0).minCoeff(&first);
  const Eigen::VectorXd origin = points.col(first);
  // Some points mostly show by far that no hyperplane holds all.
  constexpr index_t some = 64;
  if (points.cols() > 4 * some) {
    Eigen::MatrixXd arms(d, some);
    for (index_t i = 0; i < some; ++i)
      arms.col(i) = points.col(i * (points.cols() / some)) - origin;
    if (span_of(std::move(arms), 1e3 * negligible).cols() == d)
      return {Eigen::VectorXd::Zero(d), Eigen::MatrixXd::Identity(d, d)};
  }
  return {origin, span_of(points.colwise() - origin, negligible)};
}

/// The hull of points on a line.
polytope_shape segment_of(const Eigen::MatrixXd& points) {
  Eigen::Index low = 0, high = 0;
  points.row(0).minCoeff(&low);
  points.row(0).maxCoeff(&high);
  const auto [first, second] = std::minmax(low, high);
  const double side = first == low ? -1 : 1;
  polytope_shape shape;
  shape.indices = {static_cast<std::int32_t>(first), static_cast<std::int32_t>(second)};
  shape.vertices = columns_of(points, shape.indices);
  shape.normals = Eigen::RowVector2d{side, -side};
  shape.offsets = Eigen::Vector2d{side * points(0, first), -side * points(0, second)};
  shape.facets = {{0, 1, 2}, {0, 1}};
  shape.neighbors = {{0, 1, 2}, {1, 0}};
  return shape;
}

/// For each of the `chosen` points the first point that is equal to it; −1 for the others.
std::vector<std::int32_t> first_equals(const Eigen::MatrixXd& points, const index_list& chosen) {
  struct place {
    double x;
    std::int32_t index;
  };
  const auto before = [&](const place& a, const place& b) {
    if (a.x != b.x) return a.x < b.x;
    for (index_t d = 1; d < points.rows(); ++d)
      if (points(d, a.index) != points(d, b.index)) return points(d, a.index) < points(d, b.index);
    return false;
  };
  std::vector<std::int32_t> first(points.cols(), -1);
  for (const auto i : chosen) first[i] = i;
  std::vector<place> places;
  for (std::int32_t i = 0; i < points.cols(); ++i)
    if (first[i] >= 0) places.push_back({points(0, i), i});
  std::ranges::sort(places, before);
  // Where the points begin that are equal to one, and the least of all that are.
  std::vector<index_t> begin(places.size());
  std::vector<std::int32_t> least(places.size());
  for (index_t k = 0; k < std::ssize(places); ++k) {
    begin[k] = k > 0 && !before(places[k - 1], places[k]) ? begin[k - 1] : k;
    least[k] = places[k].index;
    least[begin[k]] = std::min(least[begin[k]], least[k]);
  }
  for (std::int32_t i = 0; i < points.cols(); ++i) {
    if (first[i] >= 0) continue;
    const place other{points(0, i), i};
    const auto at = std::ranges::lower_bound(places, other, before);
    if (at == places.end() || before(other, *at)) continue;
    auto& found = least[at - places.begin()];
    found = std::min(found, i);
  }
  for (index_t k = 0; k < std::ssize(places); ++k) first[places[k].index] = least[begin[k]];
  return first;
}

/// The hull of points that no hyperplane holds, at least two axes.
polytope_shape hull_by_qhull(const Eigen::MatrixXd& points, double merged) {
  const index_t d = points.rows();
  const auto found = detail::run_qhull(points.data(), static_cast<int>(points.cols()),
                                       static_cast<int>(d), merged);
  if (!found.error.empty()) throw std::runtime_error{"convex_hull: Qhull failed: " + found.error};

  const auto first = first_equals(points, found.vertices.values);
  std::vector<std::int32_t> place(points.cols(), -1);
  for (const auto i : found.vertices.values) place[first[i]] = 0;
  polytope_shape shape;
  for (index_t i = 0; i < points.cols(); ++i)
    if (place[i] == 0) {
      place[i] = static_cast<std::int32_t>(shape.indices.size());
      shape.indices.push_back(static_cast<std::int32_t>(i));
    }
  shape.vertices = columns_of(points, shape.indices);
  const auto vertex = [&](auto i) { return place[first[i]]; };

  const index_t count = std::ssize(found.vertices.begins) - 1;
  std::ranges::transform(found.vertices.values, std::back_inserter(shape.facets.values), vertex);
  shape.facets.begins = found.vertices.begins;
  if (d > 3) shape.neighbors = {found.neighbors.begins, found.neighbors.values};
  shape.normals = Eigen::Map<const Eigen::MatrixXd>(found.normals.data(), d, count);
  shape.offsets.resize(count);
  for (index_t f = 0; f < count; ++f) {
    shape.offsets[f] = -std::numeric_limits<double>::infinity();
    for (const auto v : std::as_const(shape.facets)[f])
      shape.offsets[f] =
          std::max(shape.offsets[f], shape.normals.col(f).dot(shape.vertices.col(v)));
  }
  return shape;
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

/// The hull of finite points, one per column; `flat` is how thin it may be and count as flat.
polytope_data hull_of(const Eigen::MatrixXd& input, double flat, const hull_options& how) {
  const index_t d = input.rows();
  const Eigen::VectorXd center = exact_center(input);
  Eigen::MatrixXd points = input.colwise() - center;
  const double size = points.cwiseAbs().maxCoeff();
  int exponent = 0;
  std::frexp(size, &exponent);
  const double scale = size > 0 ? std::ldexp(1.0, exponent) : 1;
  points /= scale;

  affine_subspace within = subspace_of(points, flat / scale);
  const index_t k = within.basis.cols();
  if (k == d)
    within = {Eigen::VectorXd::Zero(d), Eigen::MatrixXd::Identity(d, d)};
  else
    points = Eigen::MatrixXd{within.basis.transpose() * (points.colwise() - within.origin)};

  // Of the coordinates as they were given; Qhull knows but the centred ones.
  const double rounding = 64 * std::numeric_limits<double>::epsilon() * input.cwiseAbs().maxCoeff();
  polytope_shape shape;
  double outside = 0;
  if (k == 0) {
    shape.indices = {0};
    shape.vertices.resize(0, 1);
    shape.normals.resize(0, 0);
    shape.rays.resize(0, 0);
  } else {
    // Facets that are merged where points are nearly in a plane need not fit: then more are.
    constexpr double most_merged = 1e-9;
    for (double merged = rounding / scale;; merged = std::min(64 * merged, most_merged)) {
      shape = k == 1 ? segment_of(points) : hull_by_qhull(points, merged);
      shape.rays.resize(k, 0);
      arrange(shape, true, how.simplicial);
      if (k <= 3 || closes_up(shape.simplices, k)) break;
      if (merged == most_merged)
        throw std::runtime_error{
            "convex_hull: the facets do not close up. A larger tolerance may help"};
    }
    outside = farthest_outside(shape, points);
    if (outside * scale > std::max(how.tolerance, 1e-9 * size))
      throw std::runtime_error{"convex_hull: the result does not hold; a point is outside by " +
                               in_digits(outside * scale) + ". A larger tolerance may help"};
  }
  const index_list indices = shape.indices;
  shape.vertices *= scale;
  shape.offsets *= scale;
  within.origin = within.origin * scale + center;
  polytope_data out = embed(std::move(shape), within);
  out.vertices = columns_of(input, indices);
  out.tolerance = std::max({how.tolerance, rounding, outside * scale, k < d ? flat : 0.0,
                            std::numeric_limits<double>::min()});
  return out;
}

}  // namespace

template <Scalar S>
std::shared_ptr<const polytope_data> make_hull(points_view<S, dynamic> points,
                                               const Eigen::VectorXd& origin,
                                               const hull_options& how) {
  const index_t d = points.dimension();
  expects(how.tolerance >= 0 && std::isfinite(how.tolerance),
          "convex_hull: the tolerance must not be negative");
  expect_from(0, how.threads, "threads (0 leaves the choice to OpenMP)");
  expects(points.size() <= std::numeric_limits<std::int32_t>::max(),
          "convex_hull: no more than 2^31 - 1 points");
  const auto candidates = hull_candidates(points, how);
  if (how.monitor.stop.stop_requested()) throw cancelled{};
  if (candidates.empty()) {
    auto empty = *make_empty(d);
    empty.non_finite = points.size();
    return std::make_shared<const polytope_data>(std::move(empty));
  }
  Eigen::MatrixXd chosen(d, std::ssize(candidates));
  for (index_t i = 0; i < chosen.cols(); ++i)
    chosen.col(i) = points[candidates[i]].template cast<double>();
  const double size = d == 0 ? 0 : chosen.cwiseAbs().maxCoeff();
  expects(size <= largest_coordinate, "convex_hull: coordinates must be at most 10^307");
  const double flat =
      std::max(how.tolerance, size * (4 * double(std::numeric_limits<S>::epsilon()) +
                                      32 * std::numeric_limits<double>::epsilon()));
  polytope_data out = hull_of(chosen, flat, how);
  for (auto& i : out.indices) i = candidates[i];
  out.non_finite = candidates.non_finite;
  translate(out, origin);
  return std::make_shared<const polytope_data>(std::move(out));
}
template std::shared_ptr<const polytope_data> make_hull(points_view<float, dynamic>,
                                                        const Eigen::VectorXd&,
                                                        const hull_options&);
template std::shared_ptr<const polytope_data> make_hull(points_view<double, dynamic>,
                                                        const Eigen::VectorXd&,
                                                        const hull_options&);

std::shared_ptr<const polytope_data> make_empty(index_t dimension) {
  polytope_data none;
  none.dimension = dimension;
  none.vertices.resize(dimension, 0);
  none.rays.resize(dimension, 0);
  // Half-spaces that contradict each other, so that what looks at these alone is right, too.
  none.normals = Eigen::MatrixXd::Zero(dimension, 2);
  none.offsets = Eigen::Vector2d{-1, -1};
  if (dimension > 0) none.normals.row(0) << 1, -1;
  return std::make_shared<const polytope_data>(std::move(none));
}

}  // namespace cilantro
