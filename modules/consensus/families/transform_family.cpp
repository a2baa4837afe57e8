// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
module cilantro.consensus;

namespace cilantro {

std::optional<affine_parts<double, dynamic>> fit_transform(
    transform_kind kind, const std::optional<gathered_points>& source,
    const std::optional<gathered_points>& target, double negligible) {
  if (!target || !source || source->points.cols() == 0) return std::nullopt;
  const index_t d = source->points.rows();
  const Eigen::VectorXd to = target->points.rowwise().mean(),
                        from = source->points.rowwise().mean();
  const Eigen::MatrixXd onto = target->points.colwise() - to,
                        moving = source->points.colwise() - from;
  const Eigen::MatrixXd spread = moving * moving.transpose(), cross = onto * moving.transpose();

  // As many directions must be seen as the transform has to know the image of.
  const bool is_affine = kind == transform_kind::affine;
  const index_t seen = is_affine ? d : std::max<index_t>(d - 1, kind == transform_kind::similarity);
  const Eigen::VectorXd extent = decompose_symmetric(spread).values;
  if (seen > 0 && !(extent[d - seen] > negligible * negligible * extent[d - 1]))
    return std::nullopt;

  Eigen::MatrixXd linear;
  if (is_affine) {
    linear = solve_symmetric(spread, cross.transpose()).transpose();
  } else {
    if (!cross.allFinite()) return std::nullopt;
    linear = nearest_rotation(cross);
    if (kind == transform_kind::similarity) {
      const double scale = linear.cwiseProduct(cross).sum() / spread.trace();
      if (!(scale > 0)) return std::nullopt;
      linear *= scale;
    }
  }
  const Eigen::VectorXd translation = target->origin + to - linear * (source->origin + from);
  if (!linear.allFinite() || !translation.allFinite()) return std::nullopt;
  return affine_parts<double, dynamic>{linear, translation};
}

template <Scalar S, int D>
double pair_distance(points_view<S, D> source, points_view<S, D> target,
                     const Eigen::Matrix<S, D, D>& linear, const point_vector<S, D>& translation,
                     index_t s, index_t t) {
  double sum = 0;
  const auto onto = target[t], moving = source[s];
  for (index_t i = 0; i < source.dimension(); ++i) {
    double difference = double(translation[i]) - double(onto[i]);
    for (index_t k = 0; k < source.dimension(); ++k)
      difference += double(linear(i, k)) * double(moving[k]);
    sum += difference * difference;
  }
  return std::sqrt(sum);
}

#define CILANTRO_INSTANTIATE(S, D)                                                                 \
  template double pair_distance(points_view<S, D>, points_view<S, D>,                              \
                                const Eigen::Matrix<S, D, D>&, const point_vector<S, D>&, index_t, \
                                index_t);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
