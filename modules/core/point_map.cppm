// SPDX-License-Identifier: MIT
//
// What moves points: all of them alike, or each in its own way.
export module cilantro.core:point_map;

import cilantro.standard;
import cilantro.eigen;
import :error;
import :execution;
import :parallel;
import :points;
import :transform;

namespace cilantro {

/// What moves the points of a set: an `AffineMap` all alike, a field each in its own way.
///
/// Semantics: `map(i, p)` is where point i, which lies at p, comes to lie; `Scalar` is that of the
/// points. Optional: `map.size()`, how many points it moves, which then must be as many as there
/// are; and `map.normal(i, n)`, where the normal n of point i points to, of any length. Pure, and
/// called from several threads at once. Models: every `AffineMap`; a struct of yours.
export template <class M, int D>
concept PointMap =
    AffineMap<M> ||
    (requires { requires Scalar<typename M::Scalar>; } &&
     requires(const M& map, index_t i, const point_vector<typename M::Scalar, D>& p) {
       { map(i, p) } -> std::convertible_to<point_vector<typename M::Scalar, D>>;
     });

/// A `PointMap` that turns normals, too.
export template <class M, int D>
concept NormalMap =
    PointMap<M, D> && (AffineMap<M> || requires(const M& map, index_t i,
                                                const point_vector<typename M::Scalar, D>& n) {
      { map.normal(i, n) } -> std::convertible_to<point_vector<typename M::Scalar, D>>;
    });

/// Where `map` moves point i, which lies at p.
export template <class M, class P, int D = P::RowsAtCompileTime>
  requires PointMap<M, D>
[[nodiscard]] point_vector<typename M::Scalar, D> moved_point(const M& map, index_t i,
                                                              const Eigen::MatrixBase<P>& p) {
  if constexpr (AffineMap<M>)
    return map.linear() * p + map.translation();
  else
    return map(i, p.derived());
}

/// A function `f(i, n)`: where `map` turns the normal n of point i, of any length. Normals of a
/// surface move by the inverse transpose of what moves its points; the function keeps `map` by
/// reference. Throws `invalid_input` for an affine map that cannot be inverted.
export template <int D, class M>
  requires NormalMap<M, D>
[[nodiscard]] auto normals_moved_by(const M& map) {
  using S = typename M::Scalar;
  using vector = point_vector<S, D>;
  if constexpr (RigidMap<M>)
    return [&map](index_t, const vector& n) -> vector { return map.linear() * n; };
  else if constexpr (AffineMap<M>)
    return [turn = Eigen::Matrix<S, D, D>{
                checked_inverse(map.linear().template cast<double>(),
                                "normals_moved_by: the transform must be finite and invertible")
                    .transpose()
                    .template cast<S>()}](index_t, const vector& n) -> vector { return turn * n; };
  else
    return [&map](index_t i, const vector& n) -> vector { return map.normal(i, n); };
}

/// Throws `invalid_input`, naming the function `who`, for a map of another dimension than the
/// points, or of another number of them.
export template <Scalar S, int D, class M>
  requires PointMap<M, D>
void expect_moves(const M& map, points_view<S, D> points, const char* who) {
  if constexpr (AffineMap<M>)
    expects(points.empty() || index_t(map.translation().size()) == points.dimension(),
            std::string{who} + ": transform and points must have the same dimension");
  else if constexpr (requires { index_t(map.size()); })
    expects(index_t(map.size()) == points.size(),
            std::string{who} + ": the map moves " + std::to_string(index_t(map.size())) +
                " points, and there are " + std::to_string(points.size()));
}

/// All points where `map` moves them. Throws `invalid_input` as `expect_moves` does.
export template <Scalar S, int D, class M>
  requires PointMap<M, D> && std::same_as<typename M::Scalar, S>
[[nodiscard]] point_matrix<S, D> moved_points(const M& map, points_view<S, D> points,
                                              const execution& how = {}) {
  expect_moves(map, points, "moved_points");
  point_matrix<S, D> moved(points.dimension(), points.size());
  parallel_for(points.size(), how,
               [&](index_t i) { moved.col(i) = moved_point(map, i, points[i]); });
  return moved;
}

}  // namespace cilantro
