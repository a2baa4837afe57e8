// SPDX-License-Identifier: MIT
module;
#include <cstddef>
#include <optional>
#include <span>

#include "core/closed_spaces.hpp"
module cilantro.model;

namespace cilantro {

template <Scalar S, int D>
std::optional<gathered_points> gather_points(points_view<S, D> points,
                                             std::span<const index_t> indices) {
  gathered_points data{Eigen::MatrixXd(points.dimension(), std::ssize(indices)),
                       Eigen::VectorXd::Zero(points.dimension())};
  for (index_t k = 0; k < std::ssize(indices); ++k) {
    const auto point = points[indices[static_cast<std::size_t>(k)]];
    if (!is_finite(point)) return std::nullopt;
    if (k == 0) data.origin = point.template cast<double>();
    data.points.col(k) = point.template cast<double>() - data.origin;
  }
  return data;
}

principal_frame frame_of(const gathered_points& data) {
  const Eigen::VectorXd mean = data.points.rowwise().mean();
  const Eigen::MatrixXd around = data.points.colwise() - mean;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes{around * around.transpose() /
                                                            double(around.cols())};
  return {data.origin + mean, axes.eigenvectors(), axes.eigenvalues()};
}

#define CILANTRO_INSTANTIATE(S, D)                                         \
  template std::optional<gathered_points> gather_points(points_view<S, D>, \
                                                        std::span<const index_t>);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
