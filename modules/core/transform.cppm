// SPDX-License-Identifier: MIT
export module cilantro.core:transform;

import cilantro.standard;
import cilantro.eigen;
import :error;
import :points;

namespace cilantro {

/// The dimension whose compiled code serves dimension D: 2, 3, or any at run time.
export template <int D>
inline constexpr int closed_dimension = D == 2 || D == 3 ? D : dynamic;

/// Writes `linear · p + translation` of every point to `out`, `Dim × N` and packed; `out` may be
/// the points' own storage. Compiled for closed dimensions.
template <Scalar S, int D>
void apply_affine(points_view<S, D> points, const Eigen::Matrix<S, D, D>& linear,
                  const point_vector<S, D>& translation, S* out, index_t out_stride);

/// As above for directions: `linear · n`, brought back to unit length; zero and non-finite ones
/// stay.
template <Scalar S, int D>
void apply_to_directions(points_view<S, D> directions, const Eigen::Matrix<S, D, D>& linear, S* out,
                         index_t out_stride);

/// Throws `invalid_input` if there is none.
Eigen::MatrixXd inverse_transpose(const Eigen::MatrixXd& linear);

/// `transform · p` for every point p, into `out`, which may be the very matrix that the points lie
/// in: each point is then moved once. Throws `invalid_input` for mismatched sizes.
export template <PointsSource P, int D, int Mode, int O, class Out>
  requires std::same_as<points_view_of<Out>, points_view_of<P>>
void transform_points(const Eigen::Transform<scalar_of<P>, D, Mode, O>& transform, const P& points,
                      Eigen::MatrixBase<Out>& out) {
  using S = scalar_of<P>;
  constexpr int C = closed_dimension<dimension_of<P>>;
  const auto view = points_in(points);
  expects(out.rows() == view.dimension() && out.cols() == view.size(),
          "transform_points: the output must have the size of the points");
  expects(transform.linear().rows() == view.dimension(),
          "transform_points: transform and points must have the same dimension");
  apply_affine<S, C>(view, transform.linear(), transform.translation(), out.derived().data(),
                     out.derived().outerStride());
}

/// `transform · p` for every point p, as a new matrix.
export template <PointsSource P, int D, int Mode, int O>
[[nodiscard]] auto transform_points(const Eigen::Transform<scalar_of<P>, D, Mode, O>& transform,
                                    const P& points) {
  const auto view = points_in(points);
  point_matrix<scalar_of<P>, dimension_of<P>> out(view.dimension(), view.size());
  transform_points(transform, points, out);
  return out;
}

/// Unit normals of the surface that `transform` moves: the inverse transpose of its linear part
/// times each normal, brought back to unit length. `out` may be the matrix of the normals itself.
/// Zero normals, which stand for unknown ones, stay zero. Throws `invalid_input` for a transform
/// that cannot be inverted, or mismatched sizes.
export template <PointsSource P, int D, int Mode, int O, class Out>
  requires std::same_as<points_view_of<Out>, points_view_of<P>>
void transform_normals(const Eigen::Transform<scalar_of<P>, D, Mode, O>& transform,
                       const P& normals, Eigen::MatrixBase<Out>& out) {
  using S = scalar_of<P>;
  constexpr int C = closed_dimension<dimension_of<P>>;
  const auto view = points_in(normals);
  expects(out.rows() == view.dimension() && out.cols() == view.size(),
          "transform_normals: the output must have the size of the normals");
  const auto linear = inverse_transpose(transform.linear().template cast<double>());
  apply_to_directions<S, C>(view, linear.template cast<S>(), out.derived().data(),
                            out.derived().outerStride());
}
export template <PointsSource P, int D, int Mode, int O>
[[nodiscard]] auto transform_normals(const Eigen::Transform<scalar_of<P>, D, Mode, O>& transform,
                                     const P& normals) {
  const auto view = points_in(normals);
  point_matrix<scalar_of<P>, dimension_of<P>> out(view.dimension(), view.size());
  transform_normals(transform, normals, out);
  return out;
}

}  // namespace cilantro
