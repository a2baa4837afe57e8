// SPDX-License-Identifier: MIT
export module cilantro.core:transform;

import cilantro.standard;
import cilantro.eigen;
import :error;
import :points;
import :oriented_points;

namespace cilantro {

template <class T>
inline constexpr bool is_projective = false;
template <Scalar S, int D, int O>
inline constexpr bool is_projective<Eigen::Transform<S, D, Eigen::Projective, O>> = true;

/// A map of points `p ↦ linear · p + translation`, of any dimension: every `Eigen::Transform` of
/// mode `Isometry`, `Affine` or `AffineCompact`, and `run_time_transform`. The transforms that a
/// registration finds map the source to the target.
export template <class T>
concept AffineMap = !is_projective<T> && requires(const T& t) {
  requires Scalar<typename T::Scalar>;
  { t.linear().rows() } -> std::convertible_to<index_t>;
  { t.translation().size() } -> std::convertible_to<index_t>;
};

/// A counterpart of `Eigen::Transform` for a dimension that is known only at run time, which Eigen
/// does not have. `Mode` is `Eigen::Isometry` for a rigid motion, or `Eigen::Affine`.
export template <Scalar S, int Mode>
class run_time_transform {
 public:
  using Scalar = S;
  using linear_type = Eigen::Matrix<S, dynamic, dynamic>;
  using vector_type = Eigen::Matrix<S, dynamic, 1>;

  /// A transform of dimension 0.
  run_time_transform() = default;
  /// Throws `invalid_input` unless `linear` is square and of the dimension of `translation`.
  run_time_transform(linear_type linear, vector_type translation)
      : linear_{std::move(linear)}, translation_{std::move(translation)} {
    expects(linear_.rows() == linear_.cols() && linear_.rows() == translation_.size(),
            "run_time_transform: linear part and translation differ in dimension");
  }
  [[nodiscard]] static run_time_transform Identity(index_t dimension) {
    return {linear_type::Identity(dimension, dimension), vector_type::Zero(dimension)};
  }

  /// The linear part, `Dim × Dim`.
  [[nodiscard]] const linear_type& linear() const [[clang::lifetimebound]] { return linear_; }
  [[nodiscard]] linear_type& linear() { return linear_; }
  /// The translation.
  [[nodiscard]] const vector_type& translation() const [[clang::lifetimebound]] {
    return translation_;
  }
  [[nodiscard]] vector_type& translation() { return translation_; }
  /// The matrix for homogeneous coordinates, `(Dim + 1) × (Dim + 1)`.
  [[nodiscard]] linear_type matrix() const {
    const index_t d = translation_.size();
    linear_type all = linear_type::Identity(d + 1, d + 1);
    all.topLeftCorner(d, d) = linear_;
    all.col(d).head(d) = translation_;
    return all;
  }

  /// The transform that applies `b`, then `a`.
  [[nodiscard]] friend run_time_transform operator*(const run_time_transform& a,
                                                    const run_time_transform& b) {
    expects(a.translation_.size() == b.translation_.size(),
            "run_time_transform: the transforms differ in dimension");
    return {a.linear_ * b.linear_, a.linear_ * b.translation_ + a.translation_};
  }
  [[nodiscard]] friend vector_type operator*(const run_time_transform& t, const vector_type& p) {
    expects(t.translation_.size() == p.size(),
            "run_time_transform: transform and point differ in dimension");
    return t.linear_ * p + t.translation_;
  }
  /// The inverse. Throws `invalid_input` if there is none.
  [[nodiscard]] run_time_transform inverse() const;
  template <cilantro::Scalar T>
  [[nodiscard]] run_time_transform<T, Mode> cast() const {
    return {linear_.template cast<T>(), translation_.template cast<T>()};
  }

 private:
  linear_type linear_;
  vector_type translation_;
};

/// A rotation and a translation: Eigen's own type if the dimension is fixed.
export template <Scalar S, int D>
using rigid_transform =
    std::conditional_t<D == dynamic, run_time_transform<S, Eigen::Isometry>,
                       Eigen::Transform<S, D == dynamic ? 1 : D, Eigen::Isometry>>;

/// Any linear map and a translation: Eigen's own type if the dimension is fixed.
export template <Scalar S, int D>
using affine_transform =
    std::conditional_t<D == dynamic, run_time_transform<S, Eigen::Affine>,
                       Eigen::Transform<S, D == dynamic ? 1 : D, Eigen::Affine>>;

template <class T>
inline constexpr bool is_rigid_map = false;
template <Scalar S, int D, int O>
inline constexpr bool is_rigid_map<Eigen::Transform<S, D, Eigen::Isometry, O>> = true;
template <Scalar S>
inline constexpr bool is_rigid_map<run_time_transform<S, Eigen::Isometry>> = true;

/// A map whose type guarantees that it preserves distances.
export template <class T>
concept RigidMap = AffineMap<T> && is_rigid_map<T>;

/// The identity, for points with `dimension` coordinates.
export template <AffineMap T>
[[nodiscard]] T identity_transform(index_t dimension) {
  expect_from(0, double(dimension), "identity_transform: the dimension");
  if constexpr (requires { T::Identity(dimension); })
    return T::Identity(dimension);
  else
    return T::Identity();
}

/// A transform of type T with these parts. Throws `invalid_input` if they differ in dimension.
export template <AffineMap T, class L, class V>
[[nodiscard]] T make_transform(const Eigen::MatrixBase<L>& linear,
                               const Eigen::MatrixBase<V>& translation) {
  expects(linear.rows() == linear.cols() && linear.rows() == translation.size(),
          "make_transform: linear part and translation differ in dimension");
  T transform = identity_transform<T>(translation.size());
  expects(transform.translation().size() == translation.size(),
          "make_transform: the transform is of another dimension");
  transform.linear() = linear.template cast<typename T::Scalar>();
  transform.translation() = translation.template cast<typename T::Scalar>();
  return transform;
}

/// A map of points p ↦ `linear` · p + `translation`, as its two parts.
export template <Scalar S, int D>
struct affine_parts {
  Eigen::Matrix<S, D, D> linear;
  point_vector<S, D> translation;

  affine_parts() = default;
  affine_parts(Eigen::Matrix<S, D, D> linear_part, point_vector<S, D> translation_part)
      : linear{std::move(linear_part)}, translation{std::move(translation_part)} {}
  template <AffineMap T>
  explicit affine_parts(const T& t)
      : linear{t.linear().template cast<S>()}, translation{t.translation().template cast<S>()} {}

  template <class V>
  [[nodiscard]] point_vector<S, D> operator()(const Eigen::MatrixBase<V>& p) const {
    return linear * p.template cast<S>() + translation;
  }
};

/// The rotation nearest to a square matrix in the Frobenius norm: with determinant 1, never a
/// reflection. Where the matrix does not determine the rotation, it turns as little as possible: a
/// matrix of zeros gives the identity. Throws `invalid_input` for a matrix that is not square or
/// not finite.
/// Source: Umeyama 1991, "Least-squares estimation of transformation parameters", lemma.
export [[nodiscard]] Eigen::MatrixXd nearest_rotation(const Eigen::MatrixXd& linear);

/// The inverse of a square matrix. Throws `invalid_input{what}` if there is none.
export [[nodiscard]] Eigen::MatrixXd checked_inverse(const Eigen::MatrixXd& linear,
                                                     const char* what);

template <Scalar S, int Mode>
run_time_transform<S, Mode> run_time_transform<S, Mode>::inverse() const {
  linear_type linear;
  if constexpr (Mode == Eigen::Isometry)
    linear = linear_.transpose();
  else
    linear = checked_inverse(linear_.template cast<double>(),
                             "run_time_transform: the transform cannot be inverted")
                 .template cast<S>();
  return {linear, -(linear * translation_)};
}

/// Writes `linear · p + translation` of every point to `out`, which may be the points' own storage.
/// Compiled for closed dimensions.
template <Scalar S, int D>
void apply_affine(points_view<S, D> points, const Eigen::Matrix<S, D, D>& linear,
                  const point_vector<S, D>& translation, mutable_points_view<S, D> out);

/// As above for directions: `linear · n`, scaled to unit length; zero and non-finite directions
/// stay as they are.
template <Scalar S, int D>
void apply_to_directions(points_view<S, D> directions, const Eigen::Matrix<S, D, D>& linear,
                         mutable_points_view<S, D> out);

/// Writes `transform · p` for every point p to `out`, which may be the points' own storage. Throws
/// `invalid_input` for mismatched sizes, and for points with an origin.
export template <PointsSource P, AffineMap T, MutablePoints Out>
  requires std::same_as<points_view_of<Out>, points_view_of<P>> &&
           std::same_as<typename T::Scalar, scalar_of<P>>
void transform_points(const T& transform, const P& points, Out&& out) {
  using S = scalar_of<P>;
  constexpr int C = closed_dimension<dimension_of<P>>;
  const auto view = points_in(points);
  expect_local(points, "transform_points");
  const mutable_points_view<S, C> target = mutable_points_in(out);
  expects(target.dimension() == view.dimension() && target.size() == view.size(),
          "transform_points: the output must have the size of the points");
  expects(transform.linear().rows() == view.dimension(),
          "transform_points: transform and points must have the same dimension");
  apply_affine<S, C>(view, transform.linear(), transform.translation(), target);
}

/// Returns `transform · p` for every point p as a new matrix.
export template <PointsSource P, AffineMap T>
  requires std::same_as<typename T::Scalar, scalar_of<P>>
[[nodiscard]] auto transform_points(const T& transform, const P& points) {
  const auto view = points_in(points);
  point_matrix<scalar_of<P>, dimension_of<P>> out(view.dimension(), view.size());
  transform_points(transform, points, out);
  return out;
}

/// Turns the unit normals of a surface that `transform` moves: multiplies each by the inverse
/// transpose of the linear part, and scales it to unit length. `out` may be the normals' own
/// storage. Zero normals, which stand for unknown ones, stay zero. Throws `invalid_input` for a
/// transform that cannot be inverted, or mismatched sizes.
export template <PointwiseVectors P, AffineMap T, MutablePoints Out>
  requires std::same_as<points_view_of<Out>, points_view_of<P>> &&
           std::same_as<typename T::Scalar, scalar_of<P>>
void transform_normals(const T& transform, const P& normals, Out&& out) {
  using S = scalar_of<P>;
  constexpr int C = closed_dimension<dimension_of<P>>;
  const auto view = points_in(normals);
  const mutable_points_view<S, C> target = mutable_points_in(out);
  expects(target.dimension() == view.dimension() && target.size() == view.size(),
          "transform_normals: the output must have the size of the normals");
  expects(transform.linear().rows() == view.dimension(),
          "transform_normals: transform and normals must have the same dimension");
  const Eigen::MatrixXd linear =
      checked_inverse(transform.linear().template cast<double>(),
                      "transform_normals: the transform must be finite and invertible")
          .transpose();
  apply_to_directions<S, C>(view, linear.template cast<S>(), target);
}
export template <PointwiseVectors P, AffineMap T>
  requires std::same_as<typename T::Scalar, scalar_of<P>>
[[nodiscard]] auto transform_normals(const T& transform, const P& normals) {
  const auto view = points_in(normals);
  point_matrix<scalar_of<P>, dimension_of<P>> out(view.dimension(), view.size());
  transform_normals(transform, normals, out);
  return out;
}

}  // namespace cilantro
