// SPDX-License-Identifier: MIT
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
  expects(unknowns.size() == rigid_motion::unknowns(d),
          "rigid_motion: the number of unknowns is not that of the dimension");
  const auto identity = Eigen::MatrixXd::Identity(d, d);
  const Eigen::MatrixXd half = skew(unknowns, d) / 2;
  // y' − y = A (y + y') / 2 + v. The matrix can always be inverted, since A is skew.
  Eigen::MatrixXd images(d, d + 1);
  images << identity + half, unknowns.tail(d);
  const auto moved = solve(identity - half, images);
  if (moved) return {moved->leftCols(d), moved->col(d)};
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  return {Eigen::MatrixXd::Constant(d, d, nan), Eigen::VectorXd::Constant(d, nan)};
}

motion_step affine_motion::step(const Eigen::VectorXd& unknowns, index_t d) {
  expects(unknowns.size() == affine_motion::unknowns(d),
          "affine_motion: the number of unknowns is not that of the dimension");
  return {
      Eigen::MatrixXd::Identity(d, d) + Eigen::Map<const Eigen::MatrixXd>{unknowns.data(), d, d},
      unknowns.tail(d)};
}

Eigen::MatrixXd velocity_field::at(const Eigen::VectorXd& y) const {
  Eigen::MatrixXd sum = at_origin;
  for (index_t k = 0; k < y.size(); ++k) sum += y[k] * slopes[k];
  return sum;
}

Eigen::MatrixXd velocity_field::mean_square(const Eigen::VectorXd& mean,
                                            const Eigen::MatrixXd& covariance) const {
  const Eigen::MatrixXd at_mean = at(mean);
  Eigen::MatrixXd sum = at_mean.transpose() * at_mean;
  for (index_t k = 0; k < mean.size(); ++k)
    for (index_t l = 0; l < mean.size(); ++l)
      sum += covariance(k, l) * slopes[k].transpose() * slopes[l];
  return sum;
}

Eigen::MatrixXd velocity_field::recentering(const Eigen::VectorXd& center) const {
  const index_t d = center.size(), u = at_origin.cols();
  // An affine field is known once it is at d + 1 points.
  Eigen::MatrixXd around_origin(d * (d + 1), u), around_center(d * (d + 1), u);
  for (index_t k = 0; k <= d; ++k) {
    Eigen::VectorXd y = center;
    if (k < d) y[k] += 1;
    around_origin.middleRows(k * d, d) = at(y);
    around_center.middleRows(k * d, d) = at(y - center);
  }
  return solve_least_squares(around_center, around_origin).unknowns;
}

motion_step similarity_motion::step(const Eigen::VectorXd& unknowns, index_t dimension) {
  const index_t rigid = rigid_motion::unknowns(dimension);
  motion_step move = rigid_motion::step(unknowns.head(rigid), dimension);
  move.linear *= std::exp(unknowns[rigid]);
  return move;
}

Eigen::MatrixXd similarity_motion::normalize(const Eigen::MatrixXd& linear) {
  const Eigen::MatrixXd rotation = nearest_rotation(linear);
  return rotation.cwiseProduct(linear).sum() / double(linear.rows()) * rotation;
}

double rotation_angle(const Eigen::MatrixXd& linear) {
  const double difference =
      (linear - Eigen::MatrixXd::Identity(linear.rows(), linear.cols())).norm();
  const double half_sine = difference / std::sqrt(8.0);
  // In 2D and 3D ‖R − I‖ = √8 sin(θ/2).
  const bool is_rotation =
      half_sine <= 1 && (linear * linear.transpose()).isIdentity(1e-6) && determinant(linear) > 0;
  return is_rotation ? 2 * std::asin(half_sine) : difference / std::sqrt(2.0);
}

}  // namespace cilantro
