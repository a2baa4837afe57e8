// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>
module cilantro.spatial;

import :half_space_tests;
import :linear_program;
import :polytope_shape;

namespace cilantro {
namespace {

using piece = std::shared_ptr<const polytope_data>;

bool is_solid(const polytope_data& p) {
  return p.affine_dimension == p.dimension && p.dimension > 0;
}

/// A point about which the numbers of a piece are small, and how large they are.
struct surroundings {
  Eigen::VectorXd middle;
  double size;
};
surroundings surroundings_of(const polytope_data& p) {
  const Eigen::VectorXd middle = p.vertices.rowwise().mean();
  double size = (p.vertices.colwise() - middle).cwiseAbs().maxCoeff();
  if (!p.bounded && p.offsets.size() > 0)
    size = std::max(size, (p.offsets - p.normals.transpose() * middle).cwiseAbs().maxCoeff());
  return {middle, size > 0 ? size : 1};
}

/// Some half-spaces that are added to and taken from.
class half_space_stack {
 public:
  half_space_stack(const polytope_data& first, index_t more)
      : around_{surroundings_of(first)},
        count_{first.normals.cols()},
        normals_(first.dimension, count_ + more),
        offsets_(count_ + more) {
    normals_.leftCols(count_) = first.normals;
    offsets_.head(count_) = first.offsets;
  }
  void push(const Eigen::VectorXd& normal, double offset) {
    normals_.col(count_) = normal;
    offsets_[count_++] = offset;
  }
  void pop() { --count_; }

  /// Whether a ball of this radius has room.
  [[nodiscard]] bool has_inside(double radius, double further) const {
    const Eigen::MatrixXd normals = normals_.leftCols(count_);
    const Eigen::VectorXd offsets = offsets_.head(count_) - normals.transpose() * around_.middle;
    return ball_anywhere(normals, offsets, 4 * (around_.size + further), radius).radius > radius;
  }
  [[nodiscard]] piece polytope(double tolerance) const {
    return make_intersection(normals_.leftCols(count_), offsets_.head(count_), tolerance);
  }
  [[nodiscard]] const Eigen::VectorXd& middle() const { return around_.middle; }

 private:
  surroundings around_;
  index_t count_;
  Eigen::MatrixXd normals_;
  Eigen::VectorXd offsets_;
};

double tolerance_of(const polytope_data& a, const polytope_data& b) {
  return std::max(a.tolerance, b.tolerance);
}

/// The facets of `cutter` that have some of `cut` on their outer side; nothing if one has all of it
/// there, so that the two do not meet.
struct cutting_facets {
  bool are_apart = false;
  std::vector<index_t> facets;
};
cutting_facets facets_across(const polytope_data& cut, const polytope_data& cutter) {
  const double tolerance = tolerance_of(cut, cutter);
  cutting_facets found;
  for (index_t f = 0; f < cutter.normals.cols(); ++f) {
    const auto normal = cutter.normals.col(f).transpose();
    const Eigen::RowVectorXd places = normal * cut.vertices;
    double least = places.minCoeff(), most = places.maxCoeff();
    for (index_t r = 0; r < cut.rays.cols(); ++r) {
      const double slope = normal.dot(cut.rays.col(r));
      if (slope > 1e-12) most = std::numeric_limits<double>::infinity();
      if (slope < -1e-12) least = -std::numeric_limits<double>::infinity();
    }
    if (least >= cutter.offsets[f] - tolerance) return {.are_apart = true, .facets = {}};
    if (most > cutter.offsets[f] + tolerance) found.facets.push_back(f);
  }
  return found;
}

/// What is left of `cut` without `cutter`, in pieces: for each facet that is across, what is on its
/// outer side and on the inner side of those before.
void subtract(const piece& cut, const polytope_data& cutter, polytope_pieces& left) {
  const auto across = facets_across(*cut, cutter);
  if (across.are_apart) {
    left.push_back(cut);
    return;
  }
  const double tolerance = tolerance_of(*cut, cutter);
  half_space_stack stack{*cut, std::ssize(across.facets)};
  double further = 0;
  for (const auto f : across.facets) {
    stack.push(cutter.normals.col(f), cutter.offsets[f]);
    if (!cut->bounded)
      further = std::max(further,
                         std::abs(cutter.offsets[f] - cutter.normals.col(f).dot(stack.middle())));
  }
  if (!across.facets.empty() && !stack.has_inside(tolerance, further)) {
    left.push_back(cut);
    return;
  }
  for (std::size_t k = 0; k < across.facets.size(); ++k) stack.pop();
  for (const auto f : across.facets) {
    stack.push(-cutter.normals.col(f), -cutter.offsets[f]);
    const bool is_cut = stack.has_inside(tolerance, further);
    if (is_cut)
      if (auto outer = stack.polytope(tolerance); is_solid(*outer))
        left.push_back(std::move(outer));
    stack.pop();
    if (is_cut) stack.push(cutter.normals.col(f), cutter.offsets[f]);
  }
}

}  // namespace

polytope_pieces solid_pieces(polytope_pieces pieces) {
  std::erase_if(pieces, [](const piece& p) { return !is_solid(*p); });
  return pieces;
}

polytope_pieces difference_of(const polytope_pieces& a, const polytope_pieces& b) {
  polytope_pieces left = a;
  for (const auto& cutter : b) {
    polytope_pieces next;
    for (const auto& cut : left) subtract(cut, *cutter, next);
    left = std::move(next);
  }
  return left;
}

polytope_pieces union_of(const polytope_pieces& a, const polytope_pieces& b) {
  polytope_pieces all = a, more = difference_of(b, a);
  all.insert(all.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
  return all;
}

polytope_pieces intersection_of(const polytope_pieces& a, const polytope_pieces& b) {
  polytope_pieces common;
  for (const auto& p : a) {
    for (const auto& q : b) {
      const auto across = facets_across(*p, *q);
      if (across.are_apart) continue;
      if (across.facets.empty()) {
        common.push_back(p);
        continue;
      }
      half_space_stack stack{*p, std::ssize(across.facets)};
      for (const auto f : across.facets) stack.push(q->normals.col(f), q->offsets[f]);
      if (auto both = stack.polytope(tolerance_of(*p, *q)); is_solid(*both))
        common.push_back(std::move(both));
    }
  }
  return common;
}

polytope_pieces everything_in(index_t dimension) {
  return {make_intersection(Eigen::MatrixXd(dimension, 0), Eigen::VectorXd(0), 0)};
}

namespace {

/// The two as one, if that is convex: they touch in a plane, and their hull is no larger than they
/// are together.
piece together(const polytope_data& a, const polytope_data& b) {
  if (!a.bounded || !b.bounded) return nullptr;
  const double tolerance = tolerance_of(a, b);
  const Eigen::MatrixXd in_a = bounds_of(a), in_b = bounds_of(b);
  if ((in_a.col(0) - in_b.col(1)).maxCoeff() > tolerance ||
      (in_b.col(0) - in_a.col(1)).maxCoeff() > tolerance)
    return nullptr;
  bool touch = false;
  for (index_t f = 0; f < a.normals.cols() && !touch; ++f)
    for (index_t g = 0; g < b.normals.cols() && !touch; ++g)
      touch = a.normals.col(f).dot(b.normals.col(g)) < -1 + 1e-12 &&
              std::abs(a.offsets[f] + b.offsets[g]) <= 4 * tolerance;
  if (!touch) return nullptr;
  Eigen::MatrixXd corners(a.dimension, a.vertices.cols() + b.vertices.cols());
  corners << a.vertices, b.vertices;
  auto hull = *make_hull<double>(as_points(corners), Eigen::VectorXd::Zero(a.dimension),
                                 {.tolerance = tolerance});
  const double sum = a.measure + b.measure;
  if (hull.measure - sum > tolerance * (a.area + b.area)) return nullptr;
  hull.indices.clear();
  return std::make_shared<const polytope_data>(std::move(hull));
}

}  // namespace

polytope_pieces merged(polytope_pieces pieces) {
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i < pieces.size(); ++i)
      for (std::size_t j = i + 1; j < pieces.size(); ++j)
        if (auto both = together(*pieces[i], *pieces[j])) {
          pieces[i] = std::move(both);
          pieces.erase(pieces.begin() + static_cast<std::ptrdiff_t>(j--));
          changed = true;
        }
  }
  return pieces;
}

template <Scalar S>
void find_inside(const polytope_pieces& pieces, points_view<S, dynamic> points,
                 const Eigen::VectorXd& origin, const execution& how,
                 std::span<std::uint8_t> inside) {
  std::ranges::fill(inside, std::uint8_t{0});
  std::vector<Eigen::VectorXd> offsets;
  for (const auto& p : pieces) offsets.push_back(p->offsets.array() + p->tolerance);
  parallel_blocks(points.size(), 4096, how, [&](index_t, index_t begin, index_t end) {
    std::vector<std::uint8_t> in_piece(end - begin);
    for (std::size_t p = 0; p < pieces.size(); ++p) {
      find_inside(points.slice(begin, end - begin), origin, pieces[p]->normals, offsets[p],
                  {.threads = 1}, in_piece);
      for (index_t i = begin; i < end; ++i) inside[i] |= in_piece[i - begin];
    }
  });
}
template void find_inside(const polytope_pieces&, points_view<float, dynamic>,
                          const Eigen::VectorXd&, const execution&, std::span<std::uint8_t>);
template void find_inside(const polytope_pieces&, points_view<double, dynamic>,
                          const Eigen::VectorXd&, const execution&, std::span<std::uint8_t>);

}  // namespace cilantro
