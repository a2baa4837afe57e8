// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <cmath>
#include <utility>
module cilantro.registration;

namespace cilantro {
namespace {

/// The matrix A with A · y the velocity of y.
Eigen::MatrixXd skew(const Eigen::VectorXd& unknowns, index_t d) {
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(d, d);
  const auto turn = [&](index_t from, index_t to, double angle) {
    a(to, from) = angle;
    a(from, to) = -angle;
  };
  if (d == 3) {
    for (index_t axis = 0; axis < 3; ++axis) turn((axis + 1) % 3, (axis + 2) % 3, unknowns[axis]);
    return a;
  }
  index_t k = 0;
  for (index_t from = 0; from < d; ++from)
    for (index_t to = from + 1; to < d; ++to) turn(from, to, unknowns[k++]);
  return a;
}

}  // namespace

motion_step rigid_motion::step(const Eigen::VectorXd& unknowns, index_t d) {
  const auto identity = Eigen::MatrixXd::Identity(d, d);
  const Eigen::MatrixXd half = skew(unknowns, d) / 2;
  // y' − y = A (y + y') / 2 + v. The matrix can always be inverted, since A is skew.
  const Eigen::PartialPivLU<Eigen::MatrixXd> forward{identity - half};
  return {forward.solve(identity + half), forward.solve(unknowns.tail(d))};
}

motion_step affine_motion::step(const Eigen::VectorXd& unknowns, index_t d) {
  return {
      Eigen::MatrixXd::Identity(d, d) + Eigen::Map<const Eigen::MatrixXd>{unknowns.data(), d, d},
      unknowns.tail(d)};
}

double rotation_angle(const Eigen::MatrixXd& linear) {
  const double difference =
      (linear - Eigen::MatrixXd::Identity(linear.rows(), linear.cols())).norm();
  const double half_sine = difference / std::sqrt(8.0);
  // In 2D and 3D ‖R − I‖ = √8 sin(θ/2).
  const bool is_rotation =
      half_sine <= 1 && (linear * linear.transpose()).isIdentity(1e-6) && linear.determinant() > 0;
  return is_rotation ? 2 * std::asin(half_sine) : difference / std::sqrt(2.0);
}

}  // namespace cilantro
