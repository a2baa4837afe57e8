// SPDX-License-Identifier: MIT
//
// From half-spaces to corners and rays, by the hull of dual points about the middle of the set.
module;
#include "spatial/qhull.hpp"
module cilantro.spatial:dual_hull;

import cilantro.standard;
import cilantro.core;
import cilantro.eigen;
import :polytope_data;
import :polytope_shape;

namespace cilantro {

/// Half-spaces normal · x <= offset, the normals of unit length, one per column.
struct half_space_rows {
  Eigen::MatrixXd normals;
  Eigen::VectorXd offsets;
  Eigen::VectorXd errors = {};  ///< How wrong each offset may be.
};

half_space_rows some_of(const half_space_rows& all, const std::vector<index_t>& which) {
  return {columns_of(all.normals, which), entries_of(all.offsets, which),
          entries_of(all.errors, which)};
}

/// What vertices are found about: an inner point, and the map to coordinates in which the set is
/// about as wide in all directions, x = center + axes · z.
struct round_view {
  Eigen::VectorXd center;
  Eigen::MatrixXd axes;
};

namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

constexpr const char* too_different =
    "intersect_half_spaces: the offsets are too different in size to be computed with";

/// Lower triangular L with L · Lᵀ = rows · rowsᵀ, by orthogonalising (Gram and Schmidt, modified):
/// the products themselves would lose what is thinner than 10⁻⁸ of its length.
Eigen::MatrixXd triangle_of(Eigen::MatrixXd axes) {
  const index_t d = axes.cols();
  Eigen::MatrixXd l = Eigen::MatrixXd::Zero(d, d);
  for (index_t j = 0; j < d; ++j) {
    l(j, j) = axes.col(j).norm();
    if (!(l(j, j) > 0)) l(j, j) = std::numeric_limits<double>::min();
    axes.col(j) /= l(j, j);
    for (index_t i = j + 1; i < d; ++i) {
      l(i, j) = axes.col(j).dot(axes.col(i));
      axes.col(i) -= l(i, j) * axes.col(j);
    }
  }
  return l;
}
Eigen::VectorXd solve_lower(const Eigen::MatrixXd& l, Eigen::VectorXd b) {
  for (index_t i = 0; i < b.size(); ++i) b[i] = (b[i] - l.row(i).head(i).dot(b.head(i))) / l(i, i);
  return b;
}
Eigen::VectorXd solve_upper(const Eigen::MatrixXd& l, Eigen::VectorXd b) {
  for (index_t i = b.size() - 1; i >= 0; --i)
    b[i] = (b[i] - l.col(i).tail(b.size() - i - 1).dot(b.tail(b.size() - i - 1))) / l(i, i);
  return b;
}

}  // namespace

/// The analytic centre, by damped Newton steps from an inner point, and the ellipsoid about it that
/// the logarithmic barrier gives: the set lies within it times the number of half-spaces (Nesterov
/// and Nemirovski 1994). A box of half the width `bound` about `inside` takes part, so that there
/// is a centre in all cases.
round_view rounded(const half_space_rows& set, const Eigen::VectorXd& inside, double bound) {
  const index_t d = set.normals.rows();
  round_view view{.center = inside, .axes = Eigen::MatrixXd(d, d)};
  Eigen::MatrixXd l;
  for (int step = 0; step < 60; ++step) {
    const Eigen::VectorXd slack = set.offsets - set.normals.transpose() * view.center;
    const Eigen::ArrayXd above = 1 / (bound - (view.center - inside).array());
    const Eigen::ArrayXd below = 1 / (bound + (view.center - inside).array());
    Eigen::MatrixXd scaled(slack.size() + 2 * d, d);
    scaled.topRows(slack.size()) = set.normals.transpose();
    for (index_t i = 0; i < slack.size(); ++i) scaled.row(i) /= slack[i];
    scaled.middleRows(slack.size(), d) = above.matrix().asDiagonal();
    scaled.bottomRows(d) = (-below).matrix().asDiagonal();
    const Eigen::VectorXd gradient = scaled.colwise().sum().transpose();
    l = triangle_of(std::move(scaled));
    const Eigen::VectorXd half = solve_lower(l, gradient);
    const double decrement = half.norm();
    if (!(decrement > 0.3)) break;
    view.center -= solve_upper(l, half) / (1 + decrement);
  }
  for (index_t j = 0; j < d; ++j) view.axes.col(j) = solve_upper(l, Eigen::VectorXd::Unit(d, j));
  return view;
}

namespace {

/// Where three planes in space meet, as most corners do, in closed form; nothing where that comes
/// no nearer to them than `small`.
std::optional<Eigen::Vector3d> corner_of_three(const half_space_rows& set,
                                               std::span<const std::int32_t, 3> meeting,
                                               Eigen::Vector3d place, double small) {
  const Eigen::Vector3d a = set.normals.col(meeting[0]), b = set.normals.col(meeting[1]),
                        c = set.normals.col(meeting[2]);
  const Eigen::Vector3d offsets{set.offsets[meeting[0]], set.offsets[meeting[1]],
                                set.offsets[meeting[2]]};
  const Eigen::Vector3d bc = b.cross(c), ca = c.cross(a), ab = a.cross(b);
  const double volume = a.dot(bc);
  for (int round = 0; round < 4; ++round) {
    const Eigen::Vector3d errors =
        offsets - Eigen::Vector3d{a.dot(place), b.dot(place), c.dot(place)};
    if (errors.cwiseAbs().maxCoeff() <= small) return place;
    place += (errors[0] * bc + errors[1] * ca + errors[2] * ab) / volume;
  }
  return {};
}

/// The corner of the planes that meet there, by least squares from the middle of the set, so that
/// Qhull's arithmetic, which rounds otherwise on other machines, is not in it. Planes that are
/// parallel but for rounding have none to speak of: then it is `guess`.
Eigen::VectorXd corner_of(const half_space_rows& set, std::span<const std::int32_t> meeting,
                          const Eigen::VectorXd& guess, const round_view& view) {
  const index_t d = guess.size();
  double size = view.center.cwiseAbs().maxCoeff();
  for (const auto i : meeting) size = std::max(size, std::abs(set.offsets[i]));
  const double small = 4 * epsilon * size;
  if (d == 3 && meeting.size() == 3)
    if (const auto place = corner_of_three(set, meeting.first<3>(), view.center, small))
      return *place;
  // In the rounded coordinates, in which most planes are far from parallel. The errors are a column
  // of their own, orthogonalised with the others, which bears planes that are not.
  Eigen::MatrixXd planes(std::ssize(meeting), d + 1);
  Eigen::VectorXd lengths(planes.rows()), errors(planes.rows());
  for (index_t k = 0; k < planes.rows(); ++k) {
    planes.row(k).head(d) = (view.axes.transpose() * set.normals.col(meeting[k])).transpose();
    lengths[k] = planes.row(k).head(d).norm();
    planes.row(k).head(d) /= lengths[k];
  }
  Eigen::VectorXd place = view.center;
  // The first round is exact but for rounding, which is the more the sharper the corner.
  for (int round = 0; round < 4; ++round) {
    for (index_t k = 0; k < planes.rows(); ++k)
      errors[k] = set.offsets[meeting[k]] - set.normals.col(meeting[k]).dot(place);
    if (errors.cwiseAbs().maxCoeff() <= small) break;
    planes.col(d) = errors.cwiseQuotient(lengths);
    const Eigen::MatrixXd l = triangle_of(planes);
    if (!(l.diagonal().head(d).minCoeff() > 1e-12)) return guess;
    place += view.axes * solve_upper(l.topLeftCorner(d, d), l.row(d).head(d).transpose());
  }
  return place.allFinite() ? place : guess;
}

}  // namespace

/// Vertices and rays of a set with an inner point that contains no line, and which half-spaces are
/// its facets, in coordinates of at least two axes: each facet of the hull of the dual points
/// normal / slack is a vertex, or a ray if the origin lies in it.
polytope_shape vertices_and_facets(const half_space_rows& set, const round_view& view,
                                   double tolerance) {
  const index_t d = set.normals.rows(), count = set.normals.cols();
  Eigen::MatrixXd dual(d, count + 1);
  for (index_t i = 0; i < count; ++i)
    dual.col(i) = view.axes.transpose() * set.normals.col(i) /
                  (set.offsets[i] - set.normals.col(i).dot(view.center));
  dual.col(count).setZero();
  // By how much a dual point may be wrong, which decides what meets in one vertex.
  const double nearest = (set.offsets - set.normals.transpose() * view.center).minCoeff();
  // Rounded, they are at most 1 long, and in no hyperplane; Qhull does not bear what is else.
  if (!(dual.cwiseAbs().maxCoeff() <= 1e3) ||
      span_of(dual, 1e-13 * dual.cwiseAbs().maxCoeff()).cols() < d)
    throw std::runtime_error{too_different};
  const auto found = detail::run_qhull(dual.data(), static_cast<int>(count + 1),
                                       static_cast<int>(d), std::min(1e-6, tolerance / nearest));
  if (!found.error.empty())
    throw std::runtime_error{"intersect_half_spaces: Qhull failed: " + found.error};

  struct corner {
    Eigen::VectorXd place;
    bool is_ray;
    std::vector<std::int32_t> meeting;
  };
  std::vector<corner> corners;
  for (std::size_t f = 0; f + 1 < found.vertices.begins.size(); ++f) {
    const std::span<const std::int32_t> all = std::span{found.vertices.values}.subspan(
        found.vertices.begins[f], found.vertices.begins[f + 1] - found.vertices.begins[f]);
    const Eigen::Map<const Eigen::VectorXd> normal(found.normals.data() + f * d, d);
    corner next{.place = {}, .is_ray = std::ranges::count(all, count) > 0, .meeting = {}};
    double offset = 0;
    for (const auto i : all)
      if (i != count) {
        next.meeting.push_back(i);
        offset += normal.dot(dual.col(i)) / double(all.size());
      }
    std::ranges::sort(next.meeting);
    next.is_ray = next.is_ray || offset < 1e-9;
    next.place = next.is_ray ? Eigen::VectorXd{(view.axes * normal).normalized()}
                             : corner_of(set, next.meeting,
                                         view.center + view.axes * (normal / offset), view);
    corners.push_back(std::move(next));
  }
  std::ranges::sort(corners, [](const corner& a, const corner& b) {
    if (a.is_ray != b.is_ray) return b.is_ray;
    return std::ranges::lexicographical_compare(a.place, b.place);
  });

  polytope_shape shape;
  const auto vertices = std::ranges::count(corners, false, &corner::is_ray);
  if (vertices == 0) throw std::runtime_error{too_different};
  shape.vertices.resize(d, vertices);
  shape.rays.resize(d, std::ssize(corners) - vertices);
  std::vector<std::vector<std::int32_t>> corners_of(count);
  for (index_t k = 0; k < std::ssize(corners); ++k) {
    (k < vertices ? shape.vertices.col(k) : shape.rays.col(k - vertices)) = corners[k].place;
    for (const auto i : corners[k].meeting) corners_of[i].push_back(static_cast<std::int32_t>(k));
  }
  std::vector<index_t> facets;
  for (index_t i = 0; i < count; ++i) {
    if (std::ssize(corners_of[i]) < d) continue;
    facets.push_back(i);
    shape.facets.values.insert(shape.facets.values.end(), corners_of[i].begin(),
                               corners_of[i].end());
    shape.facets.close();
  }
  shape.normals = columns_of(set.normals, facets);
  shape.offsets = entries_of(set.offsets, facets);
  return shape;
}

}  // namespace cilantro
