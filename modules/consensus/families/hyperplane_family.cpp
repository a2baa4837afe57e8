// SPDX-License-Identifier: MIT
module;
#include "consensus/kernels/plane_scores.hpp"
#include "core/closed_spaces.hpp"
module cilantro.consensus;

namespace cilantro {

template <Scalar S, int D>
std::optional<hyperplane_model<dynamic>> fit_hyperplane(points_view<S, D> points,
                                                        std::span<const std::int32_t> indices,
                                                        const hyperplane_limits& limits) {
  const index_t d = points.dimension();
  if (d < 1 || std::ssize(indices) < d) return std::nullopt;
  Eigen::VectorXd normal, through;
  if (std::ssize(indices) == d) {
    const auto sample = gather_points(points, indices);
    if (!sample) return std::nullopt;
    // The direction across all edges from the first point, which is at 0.
    const auto edges = decompose_singular(sample->points);
    if (d > 1 && !(edges.values[d - 2] > negligible_ratio<S> * edges.values[0]))
      return std::nullopt;
    normal = edges.left.col(d - 1);
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
void hyperplane_residuals(const coordinate_rows<S>& points,
                          const Eigen::Ref<const Eigen::VectorXd>& normal, double offset,
                          index_t first, std::span<S> out) {
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

namespace {

template <Scalar S, int D>
void score_by_kernel(const coordinate_rows<S>& points, std::span<const plane_in_rows> planes,
                     index_t first, index_t count, const residual_scoring& scoring,
                     std::span<data_score> sums) {
  const auto kernel = detail::for_target(
      static_cast<int>(current_vector_target()),
      []<detail::kernel_target V> { return detail::plane_scores_in<V, S, D>(); });
  constexpr std::size_t group = detail::planes_at_a_time;
  const auto [largest, scale] = limits_of<S>(scoring);
  const auto* active = scoring.active.empty() ? nullptr : scoring.active.data() + first;
  for (std::size_t begin = 0; begin < planes.size(); begin += group) {
    const std::size_t size = std::min(group, planes.size() - begin);
    std::array<S, group*(D + 1)> some{};
    for (std::size_t p = 0; p < size; ++p) {
      const auto& plane = planes[begin + p];
      for (std::size_t d = 0; d < D; ++d) some[p * (D + 1) + d] = static_cast<S>(plane.normal[d]);
      some[p * (D + 1) + D] = static_cast<S>(plane.offset);
    }
    std::array<double, group> inliers, values;
    kernel(points.rows.data() + first, points.rows.cols(), active, count, some.data(), largest,
           scale, inliers.data(), values.data());
    for (std::size_t p = 0; p < size; ++p) {
      sums[begin + p].inliers += static_cast<index_t>(inliers[p]);
      sums[begin + p].value += values[p];
    }
  }
}

}  // namespace

template <Scalar S>
void score_hyperplanes(const coordinate_rows<S>& points, std::span<const plane_in_rows> planes,
                       index_t first, index_t count, const residual_scoring& scoring,
                       std::span<data_score> sums) {
  const index_t dimension = points.rows.rows();
  if (dimension == 2) return score_by_kernel<S, 2>(points, planes, first, count, scoring, sums);
  if (dimension == 3) return score_by_kernel<S, 3>(points, planes, first, count, scoring, sums);
  std::vector<S> residuals(count);
  residual_scoring here = scoring;
  if (!here.active.empty())
    here.active = here.active.subspan(static_cast<std::size_t>(first), residuals.size());
  for (std::size_t p = 0; p < planes.size(); ++p) {
    const Eigen::Map<const Eigen::VectorXd> normal{planes[p].normal, dimension};
    hyperplane_residuals<S>(points, normal, planes[p].offset, first, residuals);
    const auto part = score_of<S>(residuals, here);
    sums[p].inliers += part.inliers;
    sums[p].value += part.value;
  }
}

#define CILANTRO_INSTANTIATE(S, D)                                  \
  template coordinate_rows<S> rows_of(points_view<S, D>);           \
  template std::optional<hyperplane_model<dynamic>> fit_hyperplane( \
      points_view<S, D>, std::span<const std::int32_t>, const hyperplane_limits&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE
template void hyperplane_residuals(const coordinate_rows<float>&,
                                   const Eigen::Ref<const Eigen::VectorXd>&, double, index_t,
                                   std::span<float>);
template void hyperplane_residuals(const coordinate_rows<double>&,
                                   const Eigen::Ref<const Eigen::VectorXd>&, double, index_t,
                                   std::span<double>);
template void score_hyperplanes(const coordinate_rows<float>&, std::span<const plane_in_rows>,
                                index_t, index_t, const residual_scoring&, std::span<data_score>);
template void score_hyperplanes(const coordinate_rows<double>&, std::span<const plane_in_rows>,
                                index_t, index_t, const residual_scoring&, std::span<data_score>);

}  // namespace cilantro
