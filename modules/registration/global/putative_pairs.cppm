// SPDX-License-Identifier: MIT
//
// Pairs of points of which many are wrong, and what the right ones among them share.
export module cilantro.registration:putative_pairs;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// A pair as it is passed to a `PairInvariant`.
export template <int D>
struct putative_pair {
  using vector = point_vector<double, D>;

  vector source, target;                ///< The two points.
  vector source_normal, target_normal;  ///< Their normals; zero if unknown.
  index_t index;                        ///< Which of the given pairs it is.
};

/// Pairs of points, some of which are of the same place: column i of all matrices is pair i.
/// Coordinates are relative to some place of each set, so that they are small.
export template <int D>
struct putative_pairs {
  using matrix = point_matrix<double, D>;

  matrix source, target;                  ///< `D × N`, finite.
  matrix source_normals, target_normals;  ///< `D × N`, zero where unknown; or no columns.
  /// Of each column, which of the given pairs it is; empty if these are all of them, in order.
  index_list numbers;
  /// Of a right pair, the target point and the moved source point are at most this far apart.
  double max_distance;
  bool oriented = false;  ///< Whether the signs of normals mean something.
  /// Whether the scale is unknown. Solvers find transforms without one: they are called for many
  /// scales of the source.
  bool any_scale = false;
  /// The direction that the transform keeps, of unit length, such as that of gravity; if any.
  std::optional<point_vector<double, D>> up = {};

  [[nodiscard]] index_t size() const { return source.cols(); }
  /// Whether there are normals, which may be unknown for some points.
  [[nodiscard]] bool has_normals() const { return source_normals.cols() > 0; }
  [[nodiscard]] putative_pair<D> operator[](index_t i) const {
    putative_pair<D> pair{source.col(i), target.col(i), {}, {}, numbers.empty() ? i : numbers[i]};
    pair.source_normal.setZero();
    pair.target_normal.setZero();
    if (has_normals()) {
      pair.source_normal = source_normals.col(i);
      pair.target_normal = target_normals.col(i);
    }
    return pair;
  }
};

/// What two right pairs share: whether both may be right under one rigid transform.
///
/// Semantics: `invariant(a, b, all)`, where a and b are of the pairs `all`, is symmetric in a and
/// b, pure, and called from several threads at once. It may be true for wrong pairs, but for two
/// right ones only rarely false. A lambda is one: `[](const auto& a, const auto& b, const auto&
/// all) {…}`. Models: `equal_lengths`, `equal_lengths_and_angles`.
export template <class T, int D>
concept PairInvariant =
    requires(const T& invariant, const putative_pair<D>& pair, const putative_pairs<D>& all) {
      { invariant(pair, pair, all) } -> std::convertible_to<bool>;
    };

/// The source points of two pairs are as far apart as their target points, to the largest distance
/// of a right pair; and the direction that is kept, if any, is. Two pairs closer than `least` times
/// that distance say nothing about each other, and do not count.
export struct equal_lengths {
  positive least = 2;

  template <int D>
  [[nodiscard]] bool operator()(const putative_pair<D>& a, const putative_pair<D>& b,
                                const putative_pairs<D>& all) const {
    const auto in_source = (b.source - a.source).eval(), in_target = (b.target - a.target).eval();
    const double length = in_source.norm(), other = in_target.norm();
    return std::abs(length - other) <= all.max_distance &&
           std::min(length, other) >= double(least) * all.max_distance &&
           (!all.up || std::abs((in_source - in_target).dot(*all.up)) <= all.max_distance);
  }
};

/// As `equal_lengths`, and the angles that the normals form with each other and with the line
/// between the points differ by at most `tolerance` in their cosines; those of unknown normals do
/// not count.
export struct equal_lengths_and_angles {
  positive least = 2;        ///< As in `equal_lengths`.
  positive tolerance = 0.5;  ///< Of cosines.

  template <int D>
  [[nodiscard]] bool operator()(const putative_pair<D>& a, const putative_pair<D>& b,
                                const putative_pairs<D>& all) const {
    if (!equal_lengths{least}(a, b, all)) return false;
    const auto alike = [&](double in_source, double in_target) {
      return std::abs(all.oriented ? in_source - in_target
                                   : std::abs(in_source) - std::abs(in_target)) <= tolerance;
    };
    const auto is_known = [](const putative_pair<D>& p) {
      return !p.source_normal.isZero(0) && !p.target_normal.isZero(0);
    };
    const auto in_source = (b.source - a.source).normalized().eval();
    const auto in_target = (b.target - a.target).normalized().eval();
    for (const auto* p : {&a, &b})
      if (is_known(*p) && !alike(p->source_normal.dot(in_source), p->target_normal.dot(in_target)))
        return false;
    return !is_known(a) || !is_known(b) ||
           alike(a.source_normal.dot(b.source_normal), a.target_normal.dot(b.target_normal));
  }
};

static_assert(PairInvariant<equal_lengths, 3> && PairInvariant<equal_lengths_and_angles, 2>);

/// A transform that a `PairSolver` proposes: p ↦ scale · rotation · p + translation.
export template <int D>
struct pair_proposal {
  /// Orthonormal, with a determinant of 1.
  Eigen::Matrix<double, D, D> rotation = Eigen::Matrix<double, D, D>::Identity();
  /// What is added last.
  point_vector<double, D> translation = point_vector<double, D>::Zero();
  double scale = 1;  ///< Solvers leave it at 1.

  /// scale · rotation.
  [[nodiscard]] Eigen::Matrix<double, D, D> linear() const { return scale * rotation; }
};

/// Finds rigid transforms that many of the pairs agree with, without a start.
///
/// Semantics: `solver.propose(pairs, how)` returns transforms from source to target, in the
/// coordinates of the pairs, in any order; none if it finds none. It proposes whatever may be
/// right: they are then refined and compared by the pairs that agree, and, if there are clouds, by
/// all of their points. Pure, and the same for any number of threads. Throws `cancelled`.
/// Models: `pair_graph`, `sampled_pairs`, `graduated_pairs`; `check_pair_solver` tests yours.
export template <class T, int D>
concept PairSolver =
    requires(const T& solver, const putative_pairs<D>& pairs, const execution& how) {
      { solver.propose(pairs, how) } -> std::same_as<std::vector<pair_proposal<D>>>;
    };

}  // namespace cilantro
