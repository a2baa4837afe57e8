// SPDX-License-Identifier: MIT
//
// Rigid motions as exponentials of twists: velocity fields y ↦ ω × y + v that last for one unit of
// time, in the unknowns (ω, v) of `rigid_motion`. In the plane, ω is an angle.
module cilantro.registration:twists;

import cilantro.standard;
import cilantro.core;
import :pose_edge;

namespace cilantro {

template <int D>
using twist = Eigen::Matrix<double, pose_unknowns<D>, 1>;

/// How many of the unknowns are rotations.
template <int D>
inline constexpr int turns = pose_unknowns<D> - D;

/// The matrix that multiplies by ω ×.
template <int D>
[[nodiscard]] Eigen::Matrix<double, D, D> turning(
    const Eigen::Matrix<double, turns<D>, 1>& rotation) {
  Eigen::Matrix<double, D, D> k;
  if constexpr (D == 2)
    k << 0, -rotation[0], rotation[0], 0;
  else
    k << 0, -rotation[2], rotation[1], rotation[2], 0, -rotation[0], -rotation[1], rotation[0], 0;
  return k;
}

/// Functions of an angle φ whose formulas cancel near 0, where series take over.
struct turn_factors {
  double sine;           ///< sin φ / φ
  double versine;        ///< (1 − cos φ) / φ²
  double rest;           ///< (φ − sin φ) / φ³
  double inverse;        ///< (1 − φ/2 · cot φ/2) / φ²
  double second, forth;  ///< The coefficients of ad² and ad⁴; see `left_jacobian_inverse`.

  explicit turn_factors(double angle) {
    const double p = angle * angle;
    if (angle < 0.1) {
      sine = 1 - p / 6 * (1 - p / 20 * (1 - p / 42 * (1 - p / 72)));
      versine = (1 - p / 12 * (1 - p / 30 * (1 - p / 56 * (1 - p / 90)))) / 2;
      rest = (1 - p / 20 * (1 - p / 42 * (1 - p / 72 * (1 - p / 110)))) / 6;
      inverse = 1.0 / 12 + p * (1.0 / 720 + p * (1.0 / 30240 + p / 1209600));
      second = 1.0 / 12 - p * p * (1.0 / 30240 + p / 604800);
      forth = -1.0 / 720 - p * (1.0 / 15120 + p / 403200);
      return;
    }
    const double half = angle / 2;
    const double alpha = half * std::cos(half) / std::sin(half);
    const double beta = half * half / (std::sin(half) * std::sin(half));
    sine = std::sin(angle) / angle;
    versine = 2 * std::sin(half) * std::sin(half) / p;
    rest = (1 - sine) / p;
    inverse = (1 - alpha) / p;
    second = (2 * (1 - alpha) + (alpha - beta) / 2) / p;
    forth = ((1 - alpha) + (alpha - beta) / 2) / (p * p);
  }
};

/// The motion that a twist stands for.
template <int D>
[[nodiscard]] rigid_transform<double, D> exponential(const twist<D>& x) {
  const auto k = turning<D>(x.template head<turns<D>>());
  const turn_factors f{x.template head<turns<D>>().norm()};
  const auto identity = Eigen::Matrix<double, D, D>::Identity();
  auto motion = rigid_transform<double, D>::Identity();
  motion.linear() = identity + f.sine * k + f.versine * k * k;
  motion.translation() = (identity + f.versine * k + f.rest * k * k) * x.template tail<D>();
  return motion;
}

/// The twist of a motion, with an angle of at most π.
template <int D>
[[nodiscard]] twist<D> logarithm(const rigid_transform<double, D>& motion) {
  twist<D> x;
  if constexpr (D == 2) {
    x[0] = std::atan2(motion(1, 0) - motion(0, 1), motion(0, 0) + motion(1, 1));
  } else {
    // Half of the angle is precise near 0 and near π.
    const Eigen::Quaterniond q{motion.linear()};
    const double sine = q.vec().norm();
    const double angle = 2 * std::atan2(sine, std::abs(q.w()));
    const double factor = sine > 0 ? (q.w() < 0 ? -angle : angle) / sine : 0.0;
    x.template head<3>() = factor * q.vec();
  }
  const auto k = turning<D>(x.template head<turns<D>>());
  const auto& t = motion.translation();
  const turn_factors f{x.template head<turns<D>>().norm()};
  x.template tail<D>() = t - k * t / 2 + f.inverse * (k * (k * t));
  return x;
}

/// Expresses twists of coordinates in those that `motion` moves them to.
template <int D>
[[nodiscard]] pose_information<D> adjoint(const rigid_transform<double, D>& motion) {
  constexpr int u = turns<D>;
  pose_information<D> a = pose_information<D>::Zero();
  if constexpr (D == 2)
    a(0, 0) = 1;
  else
    a.template topLeftCorner<u, u>() = motion.linear();
  for (int i = 0; i < u; ++i)
    a.template block<D, 1>(u, i) = -turning<D>(a.template block<u, 1>(0, i)) * motion.translation();
  a.template bottomRightCorner<D, D>() = motion.linear();
  return a;
}

/// By how much the logarithm of a motion with twist x changes if a small motion follows it:
/// log(exp(ε) exp(x)) = x + J⁻¹ ε.
/// Source: Bullo & Murray 1995, "Proportional derivative (PD) control on the Euclidean group",
/// section 2: J⁻¹ = 1 − ad / 2 + (2 (1 − α) + (α − β) / 2) (ad / φ)² + ((1 − α) + (α − β) / 2) (ad
/// / φ)⁴ with α = φ/2 · cot φ/2 and β = (φ/2 / sin φ/2)².
template <int D>
[[nodiscard]] pose_information<D> left_jacobian_inverse(const twist<D>& x) {
  constexpr int u = turns<D>;
  pose_information<D> ad = pose_information<D>::Zero();
  const auto k = turning<D>(x.template head<u>());
  if constexpr (D == 3) ad.template topLeftCorner<u, u>() = k;
  for (int i = 0; i < u; ++i)
    ad.template block<D, 1>(u, i) =
        -turning<D>(Eigen::Matrix<double, u, 1>::Unit(i)) * x.template tail<D>();
  ad.template bottomRightCorner<D, D>() = k;
  const turn_factors f{x.template head<u>().norm()};
  const pose_information<D> square = ad * ad;
  return pose_information<D>::Identity() - ad / 2 + f.second * square + f.forth * square * square;
}

/// Without the rounding errors of its linear part.
template <int D>
[[nodiscard]] rigid_transform<double, D> normalized(rigid_transform<double, D> motion) {
  if constexpr (D == 2) {
    const Eigen::Vector2d axis{motion(0, 0) + motion(1, 1), motion(1, 0) - motion(0, 1)};
    const double c = axis[0] / axis.norm(), s = axis[1] / axis.norm();
    motion.linear() << c, -s, s, c;
  } else {
    motion.linear() = Eigen::Quaterniond{motion.linear()}.normalized().toRotationMatrix();
  }
  return motion;
}

}  // namespace cilantro
