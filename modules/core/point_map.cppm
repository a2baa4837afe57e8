// SPDX-License-Identifier: MIT
//
// Maps that move points: all of them alike, or each in its own way.
export module cilantro.core:point_map;

import cilantro.standard;
import cilantro.eigen;
import :error;
import :execution;
import :oriented_points;
import :parallel;
import :points;
import :sizes;
import :transform;

namespace cilantro {

/// A map that moves the points of a set: an `AffineMap` moves all alike; a field moves each in its
/// own way.
///
/// Semantics: `map(i, p)` is the new place of point i, which lies at p; `Scalar` is that of the
/// points. Optional: `map.size()`, the number of points that it moves, which then must be that of
/// the set; `map.normal(i, n)`, the new direction, of any length, of the normal n of point i; and
/// `map.move_all(points, out, how)`, which does the same to a whole set, faster. Pure, and called
/// from several threads at once. Models: every `AffineMap`; a struct of yours.
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

/// Where `map` moves point i, which lies at p. If p is not finite, neither is the result. Throws
/// `invalid_input` if the map returns a point of another dimension.
export template <class M, class P, int D = P::RowsAtCompileTime>
  requires PointMap<M, D>
[[nodiscard]] point_vector<typename M::Scalar, D> moved_point(const M& map, index_t i,
                                                              const Eigen::MatrixBase<P>& p) {
  if constexpr (AffineMap<M>) {
    return map.linear() * p + map.translation();
  } else {
    using S = typename M::Scalar;
    if (!is_finite(p))
      return point_vector<S, D>::Constant(p.size(), std::numeric_limits<S>::quiet_NaN());
    point_vector<S, D> moved = map(i, p.derived());
    if constexpr (D == dynamic) expect_coordinates(moved.size(), p.size());
    return moved;
  }
}

/// A function `f(i, n)` that returns the direction, of any length, to which `map` turns the normal
/// n of point i. Normals of a surface move by the inverse transpose of the map of its points. A
/// field is kept by reference; an affine map is copied. Throws `invalid_input` for an affine map
/// that cannot be inverted.
export template <int D, class M>
  requires NormalMap<M, D>
[[nodiscard]] auto normals_moved_by(const M& map) {
  using S = typename M::Scalar;
  using vector = point_vector<S, D>;
  if constexpr (AffineMap<M>) {
    Eigen::Matrix<S, D, D> turn = map.linear();
    if constexpr (!RigidMap<M>)
      turn = checked_inverse(map.linear().template cast<double>(),
                             "normals_moved_by: the transform must be finite and invertible")
                 .transpose()
                 .template cast<S>();
    return [turn](index_t, const vector& n) -> vector { return turn * n; };
  } else {
    return [&map](index_t i, const vector& n) -> vector { return map.normal(i, n); };
  }
}
template <int D, class M>
  requires NormalMap<M, D> && (!AffineMap<M>)
void normals_moved_by(const M&& map) = delete;

/// Throws `invalid_input`, naming the function `who`, if the map is for another dimension or
/// another number of points.
export template <Scalar S, int D, class M>
  requires PointMap<M, D>
void expect_moves(const M& map, points_view<S, D> points, const char* who) {
  if constexpr (AffineMap<M>) {
    expects(points.empty() || index_t(map.translation().size()) == points.dimension(),
            std::string{who} + ": transform and points must have the same dimension");
  } else {
    // Eigen converts vectors of any size into fixed ones, so the types alone do not tell.
    using moved = std::remove_cvref_t<decltype(map(index_t{}, points[index_t{}]))>;
    if constexpr (D == dynamic && EigenMatrix<moved>)
      expects(points.empty() || moved::RowsAtCompileTime == dynamic ||
                  index_t(moved::RowsAtCompileTime) == points.dimension(),
              std::string{who} + ": the map moves points of " +
                  std::to_string(int(moved::RowsAtCompileTime)) + " coordinates, but these have " +
                  std::to_string(points.dimension()));
    if constexpr (requires { index_t(map.size()); })
      expects(index_t(map.size()) == points.size(),
              std::string{who} + ": the map moves " + std::to_string(index_t(map.size())) +
                  " points, but there are " + std::to_string(points.size()));
  }
}

/// All points, moved by `map`. Throws `invalid_input` as `expect_moves` does, and for points with
/// an origin.
export template <PointsSource P, class M>
  requires PointMap<M, dimension_of<P>> && std::same_as<typename M::Scalar, scalar_of<P>>
[[nodiscard]] auto moved_points(const M& map, const P& points, const execution& how = {}) {
  expect_local(points, "moved_points");
  const auto view = points_in(points);
  expect_moves(map, view, "moved_points");
  point_matrix<scalar_of<P>, dimension_of<P>> moved(view.dimension(), view.size());
  if constexpr (requires { map.move_all(view, mutable_points_in(moved), how); })
    map.move_all(view, mutable_points_in(moved), how);
  else
    parallel_for(view.size(), how, [&](index_t i) { moved.col(i) = moved_point(map, i, view[i]); });
  return moved;
}

}  // namespace cilantro
