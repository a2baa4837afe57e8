// SPDX-License-Identifier: MIT
module;
#include <cmath>
#include <optional>
#include <span>

#include "core/closed_spaces.hpp"
module cilantro.model;

namespace cilantro {

template <Scalar S, int D>
std::optional<hyperplane_model<dynamic>> fit_hyperplane(points_view<S, D> points,
                                                        std::span<const index_t> indices,
                                                        const hyperplane_limits& limits) {
  const index_t d = points.dimension();
  if (d < 1 || std::ssize(indices) < d) return std::nullopt;
  Eigen::VectorXd normal, through;
  if (std::ssize(indices) == d) {
    const auto sample = gather_points(points, indices);
    if (!sample) return std::nullopt;
    // The direction across all edges from the first point, which is at 0.
    const Eigen::JacobiSVD<Eigen::MatrixXd> edges{sample->points, Eigen::ComputeFullU};
    const auto& lengths = edges.singularValues();
    if (d > 1 && !(lengths[d - 2] > negligible_ratio<S> * lengths[0])) return std::nullopt;
    normal = edges.matrixU().col(d - 1);
    through = sample->origin;
  } else {
    const auto frame = frame_of(points, indices);
    if (!frame) return std::nullopt;
    // Variances are squares, and rounding is that of double.
    if (d > 1 && !(frame->variances[1] > negligible_ratio<double> * frame->variances[d - 1]))
      return std::nullopt;
    normal = frame->axes.col(0);
    through = frame->mean;
  }
  if (!allows(limits.normal, normal)) return std::nullopt;
  index_t largest = 0;
  normal.cwiseAbs().maxCoeff(&largest);
  if (normal[largest] < 0) normal = -normal;
  return hyperplane_model<dynamic>{normal, -normal.dot(through)};
}

template <Scalar S, int D>
coordinate_rows<S> rows_of(points_view<S, D> points) {
  index_t first = 0;
  while (first + 1 < points.size() && !is_finite(points[first])) ++first;
  const point_vector<S, D> origin = points[first];
  coordinate_rows<S> all{{}, origin.template cast<double>()};
  all.rows.resize(points.dimension(), points.size());
  for (index_t i = 0; i < points.size(); ++i) all.rows.col(i) = points[i] - origin;
  return all;
}

template <Scalar S>
void hyperplane_residuals(const coordinate_rows<S>& points, const Eigen::VectorXd& normal,
                          double offset, index_t first, std::span<S> out) {
  const index_t n = std::ssize(out);
  Eigen::Map<Eigen::Array<S, 1, dynamic>> sum{out.data(), n};
  const auto row = [&](index_t d) { return points.rows.row(d).segment(first, n).array(); };
  const auto factor = [&](index_t d) { return static_cast<S>(normal[d]); };
  const S constant = static_cast<S>(offset);
  // In one pass where there are few coordinates.
  if (normal.size() == 3) {
    sum = (constant + factor(0) * row(0) + factor(1) * row(1) + factor(2) * row(2)).abs();
    return;
  }
  sum.setConstant(constant);
  for (index_t d = 0; d < normal.size(); ++d) sum += factor(d) * row(d);
  sum = sum.abs();
}

#define CILANTRO_INSTANTIATE(S, D)                                  \
  template coordinate_rows<S> rows_of(points_view<S, D>);           \
  template std::optional<hyperplane_model<dynamic>> fit_hyperplane( \
      points_view<S, D>, std::span<const index_t>, const hyperplane_limits&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE
template void hyperplane_residuals(const coordinate_rows<float>&, const Eigen::VectorXd&, double,
                                   index_t, std::span<float>);
template void hyperplane_residuals(const coordinate_rows<double>&, const Eigen::VectorXd&, double,
                                   index_t, std::span<double>);

}  // namespace cilantro
