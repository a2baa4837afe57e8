// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "spatial/qhull.hpp"
module cilantro.spatial;

import :half_space_tests;
import :linear_program;
import :polytope_measures;
import :polytope_shape;

namespace cilantro {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

constexpr const char* too_different =
    "intersect_half_spaces: the offsets are too different in size to be computed with";

/// Half-spaces normal · x <= offset, the normals of unit length, one per column.
struct rows {
  Eigen::MatrixXd normals;
  Eigen::VectorXd offsets;
  Eigen::VectorXd errors = {};  ///< How wrong each offset may be.
};

rows some_of(const rows& all, const std::vector<index_t>& which) {
  return {columns_of(all.normals, which), entries_of(all.offsets, which),
          entries_of(all.errors, which)};
}

/// What vertices are found about: an inner point, and the map to coordinates in which the set is
/// about as wide in all directions, x = center + axes · z.
struct round_view {
  Eigen::VectorXd center;
  Eigen::MatrixXd axes;
};

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

/// The analytic centre, by damped Newton steps from an inner point, and the ellipsoid about it that
/// the logarithmic barrier gives: the set lies within it times the number of half-spaces (Nesterov
/// and Nemirovski 1994). A box of half the width `bound` about `inside` takes part, so that there
/// is a centre in all cases.
round_view rounded(const rows& set, const Eigen::VectorXd& inside, double bound) {
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

/// The corner nearest to `guess` of the planes that meet there, by least squares.
Eigen::VectorXd polished(const rows& set, std::span<const std::int32_t> meeting,
                         const Eigen::VectorXd& guess, const round_view& view) {
  double worst = 0, size = guess.cwiseAbs().maxCoeff();
  for (const auto i : meeting) {
    worst = std::max(worst, std::abs(set.offsets[i] - set.normals.col(i).dot(guess)));
    size = std::max(size, std::abs(set.offsets[i]));
  }
  if (worst <= 4 * epsilon * size) return guess;
  // In the rounded coordinates, in which the planes are far from parallel.
  Eigen::MatrixXd planes(std::ssize(meeting), guess.size());
  Eigen::VectorXd errors(planes.rows());
  for (index_t k = 0; k < planes.rows(); ++k) {
    const auto normal = set.normals.col(meeting[k]);
    planes.row(k) = (view.axes.transpose() * normal).transpose();
    const double length = planes.row(k).norm();
    planes.row(k) /= length;
    errors[k] = (set.offsets[meeting[k]] - normal.dot(guess)) / length;
  }
  const Eigen::VectorXd right = planes.transpose() * errors;
  const Eigen::MatrixXd l = triangle_of(std::move(planes));
  if (!(l.diagonal().minCoeff() > 1e-5)) return guess;
  return guess + view.axes * solve_upper(l, solve_lower(l, right));
}

/// Vertices and rays of a set with an inner point that contains no line, and which half-spaces are
/// its facets, in coordinates of at least two axes: each facet of the hull of the dual points
/// normal / slack is a vertex, or a ray if the origin lies in it.
polytope_shape vertices_and_facets(const rows& set, const round_view& view, double tolerance) {
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
  const auto found =
      detail::run_qhull(dual.data(), static_cast<int>(count + 1), static_cast<int>(d),
                        detail::qhull_wish::facets, std::min(1e-6, tolerance / nearest));
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
    next.is_ray = next.is_ray || offset < 1e-9;
    next.place = next.is_ray ? Eigen::VectorXd{(view.axes * normal).normalized()}
                             : polished(set, next.meeting,
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

/// The same on a line.
polytope_shape interval(const rows& set) {
  polytope_shape shape;
  std::vector<double> ends;
  std::vector<index_t> facets;
  for (const double side : {-1.0, 1.0}) {
    index_t best = -1;
    for (index_t i = 0; i < set.normals.cols(); ++i)
      if (set.normals(0, i) * side > 0 && (best < 0 || set.offsets[i] < set.offsets[best]))
        best = i;
    if (best < 0) continue;
    facets.push_back(best);
    ends.push_back(side * set.offsets[best]);
  }
  shape.normals = columns_of(set.normals, facets);
  shape.offsets = entries_of(set.offsets, facets);
  shape.vertices = Eigen::Map<const Eigen::RowVectorXd>(ends.data(), 1, std::ssize(ends));
  shape.rays.resize(1, facets.size() == 1 ? 1 : 0);
  if (facets.size() == 1) shape.rays(0, 0) = -shape.normals(0, 0);
  for (std::size_t f = 0; f < facets.size(); ++f) {
    shape.facets.values.push_back(static_cast<std::int32_t>(f));
    shape.facets.close();
  }
  if (facets.size() == 2)
    shape.neighbors = {{0, 1, 2}, {1, 0}};
  else
    shape.neighbors = {{0, 0}, {}};
  return shape;
}

/// A set with an inner point, in coordinates of at least one axis.
polytope_shape shape_of(const rows& set, const Eigen::VectorXd& inside, double bound,
                        double tolerance) {
  const index_t d = set.normals.rows();
  const Eigen::MatrixXd across = span_of(set.normals, 1e-9);
  if (const index_t k = across.cols(); k < d) {
    // Lines: what is across them is the same everywhere along.
    const Eigen::MatrixXd along = complement_of(across);
    polytope_shape shape;
    if (k == 0) {
      shape.vertices = inside;
      shape.normals.resize(d, 0);
      shape.rays.resize(d, 0);
    } else {
      const rows less{across.transpose() * set.normals, set.offsets, set.errors};
      shape = shape_of(less, across.transpose() * inside, bound, tolerance);
      const Eigen::VectorXd place = along * (along.transpose() * inside);
      shape.vertices = Eigen::MatrixXd{(across * shape.vertices).colwise() + place};
      shape.rays = Eigen::MatrixXd{across * shape.rays};
      shape.normals = Eigen::MatrixXd{across * shape.normals};
    }
    const index_t corners = shape.vertices.cols(), rays = shape.rays.cols();
    shape.rays.conservativeResize(d, rays + 2 * along.cols());
    shape.rays.rightCols(2 * along.cols()) << along, -along;
    lists_of_indices facets;
    for (index_t f = 0; f < shape.facets.size(); ++f) {
      const auto list = std::as_const(shape.facets)[f];
      facets.values.insert(facets.values.end(), list.begin(), list.end());
      for (index_t r = rays; r < shape.rays.cols(); ++r)
        facets.values.push_back(static_cast<std::int32_t>(corners + r));
      facets.close();
    }
    shape.facets = std::move(facets);
    return shape;
  }
  if (d == 1) return interval(set);
  return vertices_and_facets(set, rounded(set, inside, bound), tolerance);
}

/// The rows without those that say the same as another or nothing, normals of unit length; nothing
/// if one of them cannot be met.
std::optional<rows> cleaned(const Eigen::MatrixXd& normals, const Eigen::VectorXd& offsets) {
  const index_t d = normals.rows();
  std::vector<std::int32_t> order;
  rows unit{normals, offsets};
  for (index_t i = 0; i < normals.cols(); ++i) {
    expects(normals.col(i).allFinite() && !std::isnan(offsets[i]),
            "intersect_half_spaces: normals must be finite, and offsets numbers");
    // Scaled first, so that the square is in range.
    const double largest = d == 0 ? 0 : normals.col(i).cwiseAbs().maxCoeff();
    const bool says_nothing =
        offsets[i] == std::numeric_limits<double>::infinity() || (largest == 0 && offsets[i] >= 0);
    if (says_nothing) continue;
    if (largest == 0 || offsets[i] == -std::numeric_limits<double>::infinity()) return {};
    const Eigen::VectorXd scaled = normals.col(i) / largest;
    const double length = scaled.norm();
    unit.normals.col(i) = scaled / length;
    unit.offsets[i] = offsets[i] / largest / length;
    expects(std::isfinite(unit.offsets[i]),
            "intersect_half_spaces: an offset is out of range for its normal");
    order.push_back(static_cast<std::int32_t>(i));
  }
  const auto compare = [&](std::int32_t a, std::int32_t b) {
    for (index_t k = 0; k < d; ++k)
      if (unit.normals(k, a) != unit.normals(k, b))
        return unit.normals(k, a) < unit.normals(k, b) ? -1 : 1;
    return 0;
  };
  std::ranges::sort(order, [&](auto a, auto b) {
    const int c = compare(a, b);
    return c < 0 || (c == 0 && (unit.offsets[a] < unit.offsets[b] ||
                                (unit.offsets[a] == unit.offsets[b] && a < b)));
  });
  std::vector<index_t> kept;
  for (const auto i : order)
    if (kept.empty() || compare(static_cast<std::int32_t>(kept.back()), i) != 0) kept.push_back(i);
  std::ranges::sort(kept);
  unit.errors = 64 * epsilon * unit.offsets.cwiseAbs();
  return some_of(unit, kept);
}

/// Solves for the set within a subspace, and goes into a smaller one while it has no inside.
class intersection {
 public:
  intersection(rows set, double tolerance)
      : set_{std::move(set)},
        wanted_{tolerance},
        within_{Eigen::VectorXd::Zero(set_.normals.rows()),
                Eigen::MatrixXd::Identity(set_.normals.rows(), set_.normals.rows())} {}

  std::shared_ptr<const polytope_data> result() {
    const index_t d = set_.normals.rows();
    while (within_.basis.cols() > 0) {
      const auto ball = inner_ball();
      if (ball.radius < -tolerance_) return make_empty(d);
      if (ball.radius > tolerance_)
        return finish(shape_of(set_, ball.center, widest(ball), tolerance_));
      if (!reduce(ball)) return make_empty(d);
    }
    if (set_.normals.cols() > 0) return make_empty(d);
    polytope_shape point;
    point.vertices.resize(0, 1);
    point.normals.resize(0, 0);
    point.rays.resize(0, 0);
    return finish(std::move(point));
  }

 private:
  /// Moves the origin to the centre of the set, and does so twice: the second time, offsets are as
  /// small as the set.
  ball_in_half_spaces inner_ball() {
    ball_in_half_spaces ball;
    for (int round = 0; round < 2; ++round) {
      ball = ball_of_near_rows();
      // A normal that is wrong in its last bit is wrong by as much more as the set is far away; and
      // the linear program leaves something open.
      tolerance_ = std::max(
          {wanted_, 2e-14 * bound_,
           64 * epsilon *
               (within_.origin.cwiseAbs().maxCoeff() + ball.center.cwiseAbs().maxCoeff())});
      for (const auto i : ball.tight) tolerance_ = std::max(tolerance_, set_.errors[i]);
      if (scale_ == 0) scale_ = bound_ / 4;
      if (round > 0 || ball.radius < -4 * tolerance_) break;
      move_origin(ball.center);
      ball.center.setZero();
    }
    rounding_ = std::max(rounding_, tolerance_);
    return ball;
  }

  /// Half-spaces whose planes are very far away would make the numbers of the others small: they
  /// take part only if the ball of the others is not inside them.
  ball_in_half_spaces ball_of_near_rows() {
    std::vector<double> sizes(set_.offsets.size());
    for (index_t i = 0; i < set_.offsets.size(); ++i) sizes[i] = std::abs(set_.offsets[i]);
    std::ranges::sort(sizes);
    const double all = sizes.empty() ? 0 : sizes.back();
    const auto least = std::ranges::upper_bound(sizes, 0.0);
    for (double limit = least == sizes.end() ? 0 : 1e4 * *least;; limit *= 1e4) {
      const bool takes_all = limit >= all || !(limit > 0);
      std::vector<index_t> near;
      double size = 0;
      for (index_t i = 0; i < set_.offsets.size(); ++i)
        if (takes_all || std::abs(set_.offsets[i]) <= limit) {
          near.push_back(i);
          size = std::max(size, std::abs(set_.offsets[i]));
        }
      // Where all half-spaces meet in the centre, offsets say nothing of the size.
      const double least_size = size > 0 || scale_ > 0 ? 1e-6 * scale_ : 1;
      bound_ = 4 * std::max(size, least_size);
      const rows some = takes_all ? set_ : some_of(set_, near);
      auto ball = ball_anywhere(some.normals, some.offsets, bound_, 0);
      if (takes_all) return ball;
      const double room =
          (set_.offsets - set_.normals.transpose() * ball.center).minCoeff() - ball.radius;
      if (!ball.touches_bound && room >= -1e-12 * bound_) {
        for (auto& i : ball.tight) i = near[i];
        return ball;
      }
    }
  }

  /// How far from the centre anything can be that is not without end.
  [[nodiscard]] double widest(const ball_in_half_spaces& ball) const {
    const double farthest = set_.offsets.size() == 0 ? 0 : set_.offsets.cwiseAbs().maxCoeff();
    return 4 * std::max({bound_, farthest, ball.center.cwiseAbs().maxCoeff()});
  }

  void move_origin(const Eigen::VectorXd& to) {
    set_.offsets -= set_.normals.transpose() * to;
    set_.errors.array() += 4 * epsilon * to.cwiseAbs().maxCoeff();
    within_.origin += within_.basis * to;
  }

  /// Goes into the subspace in which the half-spaces that determine the ball hold as equations;
  /// false if the others contradict them.
  bool reduce(const ball_in_half_spaces& ball) {
    if (ball.tight.empty()) return false;
    const Eigen::MatrixXd across = span_of(columns_of(set_.normals, ball.tight), 1e-6);
    if (across.cols() == 0) return false;
    const Eigen::MatrixXd along = complement_of(across);
    move_origin(ball.center);
    // What crosses the subspace at a small angle is as much less certain there.
    rows less{along.transpose() * set_.normals, set_.offsets, set_.errors.array() + tolerance_};
    std::vector<index_t> kept;
    for (index_t i = 0; i < less.normals.cols(); ++i) {
      const double length = along.cols() == 0 ? 0 : less.normals.col(i).norm();
      if (length > 1e-9) {
        less.normals.col(i) /= length;
        less.offsets[i] /= length;
        less.errors[i] /= length;
        kept.push_back(i);
      } else if (less.offsets[i] < -4 * less.errors[i]) {
        return false;
      }
    }
    set_ = some_of(less, kept);
    within_.basis = Eigen::MatrixXd{within_.basis * along};
    return true;
  }

  std::shared_ptr<const polytope_data> finish(polytope_shape shape) {
    arrange(shape, false, false);
    if (shape.rays.cols() == 0 && shape.vertices.rows() > 3) {
      auto boundary = simplices_of_boundary(shape.vertices);
      if (!boundary.error.empty())
        throw std::runtime_error{"intersect_half_spaces: " + boundary.error};
      shape.simplices = std::move(boundary.simplices);
    }
    const double size = shape.vertices.size() == 0 ? 0 : shape.vertices.cwiseAbs().maxCoeff();
    double allowed =
        std::max({wanted_, rounding_, 64 * epsilon * size, std::numeric_limits<double>::min()});
    if (shape.vertices.rows() > 0 && !hold_within(allowed, shape.vertices)) {
      allowed = std::max(allowed, 1e-9 * size);
      if (!hold_within(allowed, shape.vertices))
        throw std::runtime_error{"intersect_half_spaces: the result does not hold within " +
                                 in_digits(allowed) + ". A larger tolerance may help"};
    }
    polytope_data out = embed(std::move(shape), within_);
    out.tolerance = allowed;
    return std::make_shared<const polytope_data>(std::move(out));
  }

  /// Whether no point is outside a half-space by more than `allowed`.
  [[nodiscard]] bool hold_within(double allowed, const Eigen::MatrixXd& points) const {
    std::vector<std::uint8_t> inside(points.cols());
    const Eigen::VectorXd offsets = set_.offsets.array() + allowed;
    find_inside(points_view<double, dynamic>{as_points(points)},
                Eigen::VectorXd::Zero(points.rows()), set_.normals, offsets, {.threads = 1},
                inside);
    return std::ranges::count(inside, 0) == 0;
  }

  rows set_;
  double wanted_;
  affine_subspace within_;
  double scale_ = 0, bound_ = 1, rounding_ = 0, tolerance_ = 0;
};

}  // namespace

std::shared_ptr<const polytope_data> make_intersection(const Eigen::MatrixXd& normals,
                                                       const Eigen::VectorXd& offsets,
                                                       double tolerance) {
  expects(tolerance >= 0 && std::isfinite(tolerance),
          "intersect_half_spaces: the tolerance must not be negative");
  const auto set = cleaned(normals, offsets);
  if (!set) return make_empty(normals.rows());
  return intersection{*set, tolerance}.result();
}

}  // namespace cilantro
