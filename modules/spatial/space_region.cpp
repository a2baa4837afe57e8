// SPDX-License-Identifier: MIT
module cilantro.spatial;

import :cell;
import :half_space_tests;

namespace cilantro {
namespace {

double tolerance_of(const polytope_data& a, const polytope_data& b) {
  return std::max(a.tolerance, b.tolerance);
}

/// Whether some axis shows that two polytopes do not meet.
bool boxes_are_apart(const polytope_data& a, const polytope_data& b, double tolerance) {
  if (!a.bounded || !b.bounded) return false;
  for (index_t d = 0; d < a.dimension; ++d)
    if (a.vertices.row(d).minCoeff() >= b.vertices.row(d).maxCoeff() - tolerance ||
        b.vertices.row(d).minCoeff() >= a.vertices.row(d).maxCoeff() - tolerance)
      return true;
  return false;
}

/// A part of a polytope that is being cut, and the tolerance that it has from all cuts.
struct part {
  cell shape;
  double tolerance;
};

/// Cuts off what is outside of `cutter`, in pieces: for each facet that is across, what is on its
/// outer side and on the inner side of those before. Writes what is inside, where that is asked
/// for; false if nothing is.
bool cut_off(const part& cut, const polytope_data& cutter, std::vector<part>* outside,
             std::optional<part>* inside) {
  const double tolerance = std::max(cut.tolerance, cutter.tolerance);
  std::vector<index_t> across;
  for (index_t f = 0; f < cutter.normals.cols(); ++f) {
    const auto [has_inner, has_outer] =
        cut.shape.beside(cutter.normals.col(f).data(), cutter.offsets[f], tolerance);
    if (!has_inner) return false;
    if (has_outer) across.push_back(f);
  }
  const cell* left = &cut.shape;
  std::optional<cell> made;
  for (const auto f : across) {
    const double *normal = cutter.normals.col(f).data(), offset = cutter.offsets[f];
    if (left != &cut.shape) {
      const auto [has_inner, has_outer] = left->beside(normal, offset, tolerance);
      if (!has_outer) continue;
      if (!has_inner) {
        if (outside) outside->push_back({*left, tolerance});
        return false;
      }
    }
    // Whether there is something inside of the last one is known.
    const bool wants_inner = inside || f != across.back();
    auto halves = left->split(normal, offset, tolerance, wants_inner, outside != nullptr);
    if (outside && halves.outer) outside->push_back({std::move(*halves.outer), tolerance});
    if (!wants_inner) return true;
    if (!halves.inner) return false;
    made = std::move(halves.inner);
    left = &*made;
  }
  if (inside) *inside = part{*left, tolerance};
  return true;
}

void subtract(const part& cut, const polytope_data& cutter, std::vector<part>& left) {
  const auto before = std::ssize(left);
  if (cut_off(cut, cutter, &left, nullptr)) return;
  // The two do not meet: what it would be cut into is the whole.
  left.erase(left.begin() + before, left.end());
  left.push_back(cut);
}

polytope_pieces as_pieces(const std::vector<part>& parts) {
  polytope_pieces pieces;
  for (const auto& p : parts)
    if (auto made = p.shape.polytope(p.tolerance)) pieces.push_back(std::move(made));
  return pieces;
}

}  // namespace

polytope_pieces solid_pieces(polytope_pieces pieces) {
  std::erase_if(pieces, [](const piece& p) { return !is_solid(*p); });
  return pieces;
}

polytope_pieces difference_of(const polytope_pieces& a, const polytope_pieces& b) {
  polytope_pieces all;
  for (const auto& whole : a) {
    std::vector<part> left{{cell{whole}, whole->tolerance}};
    for (const auto& cutter : b) {
      if (boxes_are_apart(*whole, *cutter, tolerance_of(*whole, *cutter))) continue;
      std::vector<part> next;
      for (const auto& cut : left) subtract(cut, *cutter, next);
      left = std::move(next);
    }
    std::ranges::move(as_pieces(left), std::back_inserter(all));
  }
  return all;
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
      if (boxes_are_apart(*p, *q, tolerance_of(*p, *q))) continue;
      std::optional<part> both;
      if (cut_off({cell{p}, p->tolerance}, *q, nullptr, &both))
        if (auto made = both->shape.polytope(both->tolerance)) common.push_back(std::move(made));
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
