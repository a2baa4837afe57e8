// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
module cilantro.consensus;

namespace cilantro {

template <Scalar S, int D>
std::optional<gathered_points> gather_points(points_view<S, D> points,
                                             std::span<const std::int32_t> indices) {
  gathered_points data{Eigen::MatrixXd(points.dimension(), std::ssize(indices)),
                       Eigen::VectorXd::Zero(points.dimension())};
  for (index_t k = 0; k < std::ssize(indices); ++k) {
    const auto point = points[indices[k]];
    if (!is_finite(point)) return std::nullopt;
    if (k == 0) data.origin = point.template cast<double>();
    data.points.col(k) = point.template cast<double>() - data.origin;
  }
  return data;
}

template <Scalar S, int D>
std::optional<principal_frame> frame_of(points_view<S, D> points,
                                        std::span<const std::int32_t> indices) {
  if (indices.empty() || points.dimension() == 0) return std::nullopt;
  using vector = point_vector<double, D>;
  const index_t d = points.dimension();
  // Around one of the points, so that far from the origin nothing is lost.
  const vector origin = points[indices.front()].template cast<double>();
  vector sum = vector::Zero(d);
  Eigen::Matrix<double, D, D> square = Eigen::Matrix<double, D, D>::Zero(d, d);
  for (const index_t i : indices) {
    const vector p = points[i].template cast<double>() - origin;
    sum += p;
    square.noalias() += p * p.transpose();
  }
  const double n = double(indices.size());
  const Eigen::VectorXd mean = sum / n;
  const Eigen::MatrixXd covariance = Eigen::MatrixXd{square} / n - mean * mean.transpose();
  if (!covariance.allFinite()) return std::nullopt;
  const auto axes = decompose_symmetric(covariance);
  return principal_frame{origin + mean, axes.vectors, axes.values};
}

#define CILANTRO_INSTANTIATE(S, D)                                                      \
  template std::optional<gathered_points> gather_points(points_view<S, D>,              \
                                                        std::span<const std::int32_t>); \
  template std::optional<principal_frame> frame_of(points_view<S, D>,                   \
                                                   std::span<const std::int32_t>);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
