// SPDX-License-Identifier: MIT
module cilantro.spatial;

import :dual_hull;
import :generated_set;
import :generated_shape;
import :half_space_tests;
import :linear_program;
import :polytope_measures;
import :polytope_shape;

namespace cilantro {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

/// The same on a line.
polytope_shape interval(const half_space_rows& set) {
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
polytope_shape shape_of(const half_space_rows& set, const Eigen::VectorXd& inside, double bound,
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
      const half_space_rows less{across.transpose() * set.normals, set.offsets, set.errors};
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

/// Corners of planes beyond it may be no numbers.
constexpr double farthest_plane = 1e300;

/// The rows without those that say the same as another or nothing, normals of unit length; nothing
/// if one of them cannot be met.
std::optional<half_space_rows> cleaned(const Eigen::MatrixXd& normals,
                                       const Eigen::VectorXd& offsets) {
  const index_t d = normals.rows();
  std::vector<std::int32_t> order;
  half_space_rows unit{normals, offsets};
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
    expects(std::abs(unit.offsets[i]) <= farthest_plane,
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
  intersection(half_space_rows set, double tolerance)
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
      const half_space_rows some = takes_all ? set_ : some_of(set_, near);
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
    half_space_rows less{along.transpose() * set_.normals, set_.offsets,
                         set_.errors.array() + tolerance_};
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
    if (shape.vertices.rows() > 3) shape = closed(std::move(shape));
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

  /// In more than three dimensions, where the hull of dual points may be wrong: the same if facets
  /// close up, and otherwise what is found by cutting all of space.
  polytope_shape closed(polytope_shape shape) {
    if (span_of(set_.normals, 1e-9).cols() == shape.vertices.rows() && closes_up(shape))
      return shape;
    const auto cut = generated_set::cut_from_all(set_.normals, set_.offsets, tolerance_);
    auto found = verified_shape_of(cut, tolerance_);
    if (!found)
      throw std::runtime_error{
          "intersect_half_spaces: the facets do not close up. A larger tolerance may help"};
    rounding_ = std::max(rounding_, found->tolerance);
    return std::move(found->shape);
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

  half_space_rows set_;
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
