// SPDX-License-Identifier: MIT
module;
#include <cmath>
#include <optional>

#include "core/closed_spaces.hpp"
module cilantro.model;

namespace cilantro {

std::optional<hyperplane_model<dynamic>> fit_hyperplane(const std::optional<gathered_points>& data,
                                                        double negligible,
                                                        const hyperplane_limits& limits) {
  if (!data) return std::nullopt;
  const index_t d = data->points.rows(), n = data->points.cols();
  if (d < 1 || n < d) return std::nullopt;
  Eigen::VectorXd normal, through;
  if (n == d) {
    // The direction across all edges from the first point, which is at 0.
    const Eigen::JacobiSVD<Eigen::MatrixXd> edges{data->points, Eigen::ComputeFullU};
    const auto& lengths = edges.singularValues();
    if (d > 1 && !(lengths[d - 2] > negligible * lengths[0])) return std::nullopt;
    normal = edges.matrixU().col(d - 1);
    through = data->origin;
  } else {
    const auto frame = frame_of(*data);
    if (d > 1 && !(frame.variances[1] > negligible * negligible * frame.variances[d - 1]))
      return std::nullopt;
    normal = frame.axes.col(0);
    through = frame.mean;
  }
  if (!allows(limits.normal, normal)) return std::nullopt;
  index_t largest = 0;
  normal.cwiseAbs().maxCoeff(&largest);
  if (normal[largest] < 0) normal = -normal;
  return hyperplane_model<dynamic>{normal, -normal.dot(through)};
}

template <Scalar S, int D>
void hyperplane_residuals(points_view<S, D> points, const point_vector<S, D>& origin,
                          const point_vector<S, D>& normal, S offset, S* out) {
  const S* x = points.data();
  const index_t dimension = D == dynamic ? points.dimension() : index_t{D};
  for (index_t i = 0; i < points.size(); ++i, x += points.stride()) {
    S sum = offset;
    for (index_t d = 0; d < dimension; ++d) sum += normal[d] * (x[d] - origin[d]);
    out[i] = std::abs(sum);
  }
}

#define CILANTRO_INSTANTIATE(S, D)                                                 \
  template void hyperplane_residuals(points_view<S, D>, const point_vector<S, D>&, \
                                     const point_vector<S, D>&, S, S*);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
