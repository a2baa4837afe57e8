// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
module cilantro.core;

namespace cilantro {
namespace {

/// Relative to the largest one, singular values below this are rounding.
constexpr double negligible_singular_value = 1e-10;

}  // namespace

template <Scalar S, int D>
void apply_affine(points_view<S, D> points, const Eigen::Matrix<S, D, D>& linear,
                  const point_vector<S, D>& translation, mutable_points_view<S, D> out) {
  for (index_t i = 0; i < points.size(); ++i) {
    const point_vector<S, D> moved = linear * points[i] + translation;
    out[i] = moved;
  }
}

template <Scalar S, int D>
void apply_to_directions(points_view<S, D> directions, const Eigen::Matrix<S, D, D>& linear,
                         mutable_points_view<S, D> out) {
  for (index_t i = 0; i < directions.size(); ++i) {
    point_vector<S, D> moved = linear * directions[i];
    const S length = moved.norm();
    if (length > 0 && std::isfinite(length)) moved /= length;
    out[i] = moved;
  }
}

Eigen::MatrixXd checked_inverse(const Eigen::MatrixXd& linear, const char* what) {
  expects(linear.allFinite(), what);
  const auto inverse = solve(linear, Eigen::MatrixXd::Identity(linear.rows(), linear.cols()));
  expects(inverse.has_value(), what);
  return *inverse;
}

Eigen::MatrixXd nearest_rotation(const Eigen::MatrixXd& linear) {
  expects(linear.rows() == linear.cols() && linear.allFinite(),
          "nearest_rotation: the matrix must be square and finite");
  if (linear.size() == 0) return linear;
  const index_t d = linear.rows();
  const auto [values, u, v] = decompose_singular(linear);
  const double side = determinant(u) * determinant(v) < 0 ? -1 : 1;
  index_t rank = 0;
  while (rank < d && values[rank] > negligible_singular_value * values[0]) ++rank;
  Eigen::MatrixXd middle = Eigen::MatrixXd::Identity(d, d);
  if (const index_t free = d - rank; free > 0) {
    Eigen::MatrixXd mirror = Eigen::MatrixXd::Identity(free, free);
    mirror(free - 1, free - 1) = side;
    middle.bottomRightCorner(free, free) =
        nearest_rotation(u.rightCols(free).transpose() * v.rightCols(free) * mirror) * mirror;
  } else {
    // The least singular value gives way to a mirrored answer.
    middle(d - 1, d - 1) = side;
  }
  return u * middle * v.transpose();
}

#define CILANTRO_INSTANTIATE(S, D)                                                          \
  template void apply_affine<S, D>(points_view<S, D>, const Eigen::Matrix<S, D, D>&,        \
                                   const point_vector<S, D>&, mutable_points_view<S, D>);   \
  template void apply_to_directions<S, D>(points_view<S, D>, const Eigen::Matrix<S, D, D>&, \
                                          mutable_points_view<S, D>);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
