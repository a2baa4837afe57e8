// SPDX-License-Identifier: MIT
export module cilantro.registration:motion;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// A finite motion of points: p ↦ `linear` · p + `translation`.
export using motion_step = affine_parts<double, dynamic>;

/// How a transform can change: the unknowns of a small motion, the velocity that each of them gives
/// a point, and the finite motion that they stand for.
///
/// Semantics: a small motion with unknowns δ gives the point y the velocity v(y, δ), linear in δ
/// and affine in y. `pull_back(y, g, row)` writes row[k] = g · v(y, e_k) for each of the
/// `unknowns(dimension)` unknowns: how fast a residual with gradient g at y changes with that
/// unknown. `step(δ, dimension)` is a finite motion that has this velocity in the limit of small δ.
/// `normalize(linear)` is optional, and removes rounding errors from the linear part of a
/// transform. Every translation must be a possible motion, so that motions can be expressed around
/// any centre. All functions are pure; points are Eigen vectors of double of any type.
/// `transform<S, D>` is the type of the resulting transform, `rigid_transform` or
/// `affine_transform`.
/// Models: `rigid_motion`, `affine_motion`, `similarity_motion`; `check_motion_model` tests yours.
export template <class P>
concept MotionModel =
    requires(const P& model, index_t dimension, const Eigen::VectorXd& vector, double* row) {
      typename P::template transform<float, 3>;
      requires AffineMap<typename P::template transform<double, 2>>;
      { P::unknowns(dimension) } -> std::same_as<index_t>;
      { model.pull_back(vector, vector, row) } -> std::same_as<void>;
      { model.step(vector, dimension) } -> std::same_as<motion_step>;
    };

/// The type of transform that a motion model results in.
export template <MotionModel Motion, Scalar S, int D>
using transform_of = typename Motion::template transform<S, D>;

/// Rotation and translation in any dimension. The unknowns are rotations in radians, then the
/// translation. The rotations are about x, y and z in 3D, otherwise from axis a to axis b for each
/// a < b, in the order of (a, b).
///
/// A step follows the midpoint rule: the point midway between old and new place has the velocity of
/// the step, which gives Cayley's rotations. It follows curved motions to second order.
/// Source: Rusinkiewicz 2019, "A symmetric objective function for ICP", section 3.
export struct rigid_motion {
  template <Scalar S, int D>
  using transform = rigid_transform<S, D>;

  static constexpr index_t unknowns(index_t dimension) {
    return dimension * (dimension - 1) / 2 + dimension;
  }
  template <class V>
  static void pull_back(const V& y, const V& g, double* row) {
    const index_t d = y.size();
    if (d == 3) {
      row[0] = y[1] * g[2] - y[2] * g[1];
      row[1] = y[2] * g[0] - y[0] * g[2];
      row[2] = y[0] * g[1] - y[1] * g[0];
      row += 3;
    } else {
      for (index_t a = 0; a < d; ++a)
        for (index_t b = a + 1; b < d; ++b) *row++ = y[a] * g[b] - y[b] * g[a];
    }
    for (index_t i = 0; i < d; ++i) row[i] = g[i];
  }
  [[nodiscard]] static motion_step step(const Eigen::VectorXd& unknowns, index_t dimension);
  [[nodiscard]] static Eigen::MatrixXd normalize(const Eigen::MatrixXd& linear) {
    return nearest_rotation(linear);
  }
};

/// Any linear map and a translation. The unknowns are the linear part column by column, then the
/// translation.
export struct affine_motion {
  template <Scalar S, int D>
  using transform = affine_transform<S, D>;

  static constexpr index_t unknowns(index_t dimension) { return dimension * (dimension + 1); }
  template <class V>
  static void pull_back(const V& y, const V& g, double* row) {
    for (index_t j = 0; j < y.size(); ++j)
      for (index_t i = 0; i < y.size(); ++i) *row++ = y[j] * g[i];
    for (index_t i = 0; i < y.size(); ++i) *row++ = g[i];
  }
  [[nodiscard]] static motion_step step(const Eigen::VectorXd& unknowns, index_t dimension);
};

/// Rotation, translation and a scale. The unknowns are those of `rigid_motion`, then the relative
/// change of the scale. The transform is an affine one, whose linear part is a scaled rotation.
export struct similarity_motion {
  template <Scalar S, int D>
  using transform = affine_transform<S, D>;

  static constexpr index_t unknowns(index_t dimension) {
    return rigid_motion::unknowns(dimension) + 1;
  }
  template <class V>
  static void pull_back(const V& y, const V& g, double* row) {
    rigid_motion::pull_back(y, g, row);
    row[rigid_motion::unknowns(y.size())] = y.dot(g);
  }
  [[nodiscard]] static motion_step step(const Eigen::VectorXd& unknowns, index_t dimension);
  /// The nearest rotation, times the scale that is nearest to the linear part.
  [[nodiscard]] static Eigen::MatrixXd normalize(const Eigen::MatrixXd& linear);
};

static_assert(MotionModel<rigid_motion> && MotionModel<affine_motion> &&
              MotionModel<similarity_motion>);

/// The velocities at `y`, one column per unknown.
template <MotionModel P>
[[nodiscard]] Eigen::MatrixXd velocities(const P& model, const Eigen::VectorXd& y) {
  const index_t d = y.size(), u = P::unknowns(d);
  Eigen::MatrixXd rows(u, d);
  for (index_t i = 0; i < d; ++i)
    model.pull_back(y, Eigen::VectorXd{Eigen::VectorXd::Unit(d, i)}, rows.col(i).data());
  return rows.transpose();
}

/// The velocities everywhere: an affine function of the point. Functions of it are compiled in the
/// library, whatever the model.
struct velocity_field {
  Eigen::MatrixXd at_origin;            ///< `Dim × unknowns`.
  std::vector<Eigen::MatrixXd> slopes;  ///< One per axis.

  [[nodiscard]] Eigen::MatrixXd at(const Eigen::VectorXd& y) const;
  /// The mean of v(y, δ)ᵀ v(y, δ) as a quadratic form in δ, over points of that mean and
  /// covariance.
  [[nodiscard]] Eigen::MatrixXd mean_square(const Eigen::VectorXd& mean,
                                            const Eigen::MatrixXd& covariance) const;
  /// Turns the unknowns of motions around the origin into those of the same motions around
  /// `center`.
  [[nodiscard]] Eigen::MatrixXd recentering(const Eigen::VectorXd& center) const;
};

template <MotionModel P>
[[nodiscard]] velocity_field velocities_of(const P& model, index_t dimension) {
  velocity_field field{velocities(model, Eigen::VectorXd::Zero(dimension)), {}};
  for (index_t k = 0; k < dimension; ++k)
    field.slopes.push_back(velocities(model, Eigen::VectorXd::Unit(dimension, k)) -
                           field.at_origin);
  return field;
}

/// The angle by which `linear` turns; if it is not a rotation, ‖linear − I‖ / √2, which for small
/// rotations is the same.
[[nodiscard]] double rotation_angle(const Eigen::MatrixXd& linear);

}  // namespace cilantro
