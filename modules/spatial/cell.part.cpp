// SPDX-License-Identifier: MIT
//
// Polytopes as they are cut by planes.
module cilantro.spatial:cell;

import cilantro.standard;
import cilantro.core;
import cilantro.eigen;
import :generated_set;
import :generated_shape;
import :polytope_data;
import :polytope_measures;
import :polytope_shape;

namespace cilantro {

using piece = std::shared_ptr<const polytope_data>;

bool is_solid(const polytope_data& p) {
  return p.affine_dimension == p.dimension && p.dimension > 0;
}

template <class Cell>
struct cell_halves {
  std::optional<Cell> inner, outer;
};

/// A solid polytope that is cut by what generates it, or where that is not known or does not hold
/// in the end, by its half-spaces.
class cell {
 public:
  using halves = cell_halves<cell>;
  using sides = generated_set::sides;

  explicit cell(piece whole) : whole_{std::move(whole)}, set_{*whole_} {}

  [[nodiscard]] sides beside(const double* normal, double offset, double tolerance) const {
    return set_.beside(normal, offset, tolerance);
  }

  /// What is on the inner side of a plane that cuts it, normal · x <= offset, and what is on the
  /// outer one, where these are asked for; nothing where it is no thicker than the tolerance.
  [[nodiscard]] halves split(const double* normal, double offset, double tolerance,
                             bool wants_inner, bool wants_outer) const {
    if (!set_.has_edges() || set_.dimension() < 2) return split_slowly(normal, offset, tolerance);
    halves both;
    if (wants_inner) both.inner = cell{};
    if (wants_outer) both.outer = cell{};
    set_.cut(normal, offset, tolerance, wants_inner ? &both.inner->set_ : nullptr,
             wants_outer ? &both.outer->set_ : nullptr);
    return both;
  }

  /// As a polytope again; nothing if it has no inside.
  [[nodiscard]] piece polytope(double tolerance) const {
    if (whole_) return whole_;
    if (auto made = verified_shape_of(set_, tolerance)) {
      polytope_data out = embed_in_space(std::move(made->shape));
      out.tolerance = made->tolerance;
      return std::make_shared<const polytope_data>(std::move(out));
    }
    auto made = from_planes(set_, tolerance);
    if (!is_solid(*made)) return nullptr;
    // Its neighbours have been cut otherwise: what is without end could have their parts, too.
    if (!made->bounded)
      throw std::runtime_error{
          "regions: planes are too nearly parallel to tell where an unbounded piece ends"};
    return made;
  }

 private:
  cell() = default;
  [[nodiscard]] static piece from_planes(const generated_set& set, double tolerance) {
    const auto planes = set.planes();
    const index_t d = planes.rows() - 1;
    return make_intersection(planes.topRows(d), planes.row(d).transpose(), tolerance);
  }
  [[nodiscard]] halves split_slowly(const double* normal, double offset, double tolerance) const {
    halves both;
    for (const double sign : {1.0, -1.0}) {
      generated_set half = set_;
      half.add_plane(normal, offset, sign);
      if (auto made = from_planes(half, tolerance); is_solid(*made))
        (sign > 0 ? both.inner : both.outer).emplace(std::move(made));
    }
    return both;
  }

  piece whole_;
  generated_set set_;
};

}  // namespace cilantro
