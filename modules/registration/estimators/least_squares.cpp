// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
#include "registration/kernels/pair_equations.hpp"
module cilantro.registration;

namespace cilantro {
namespace {

void add_spread(Eigen::Matrix3d& spread, const double* half) {
  for (index_t a = 0; a < 3; ++a)
    for (index_t b = a; b < 3; ++b, ++half) {
      spread(a, b) += *half;
      if (a != b) spread(b, a) += *half;
    }
}

void add_part(equation_sums<3, 6>& total, const detail::pair_sums::plane_term& part) {
  total.weight += part.weight;
  total.seen += part.weight;
  total.squared_residual += part.squared_residual;
  const double* next = part.information;
  for (index_t a = 0; a < 6; ++a) {
    total.gradient[a] += part.gradient[a];
    for (index_t b = a; b < 6; ++b) total.information(b, a) += *next++;
  }
  total.place += Eigen::Map<const Eigen::Vector3d>{part.place};
  add_spread(total.spread, part.spread);
}

/// A difference e of places y has the rows (y × u, u) for the three unit vectors u, so that sums of
/// y and of y yᵀ are all that its normal equations need.
void add_part(equation_sums<3, 6>& total, const detail::pair_sums::point_term& part) {
  total.weight += part.weight;
  total.seen += part.weight;
  total.squared_residual += part.squared_residual;
  const Eigen::Map<const Eigen::Vector3d> place{part.place};
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  add_spread(spread, part.spread);
  total.gradient.head<3>() += Eigen::Map<const Eigen::Vector3d>{part.moment};
  total.gradient.tail<3>() += Eigen::Map<const Eigen::Vector3d>{part.difference};
  auto turns = total.information.topLeftCorner<3, 3>();
  turns += spread.trace() * Eigen::Matrix3d::Identity() - spread;
  // Of the symmetric matrix the half below the diagonal counts: −[Σ w y]×.
  Eigen::Matrix3d cross;
  cross << 0, place[2], -place[1], -place[2], 0, place[0], place[1], -place[0], 0;
  total.information.bottomLeftCorner<3, 3>() += cross;
  total.information.bottomRightCorner<3, 3>() += part.weight * Eigen::Matrix3d::Identity();
  total.place += place;
  total.spread += spread;
}

/// Where the pairs of a block are among all.
struct block_weights {
  const pair_weigher* weigh;
  index_t begin;
};

}  // namespace

template <Scalar S>
equation_sums<3, 6> sum_by_kernel(const registered_surfaces<S, 3>& surfaces,
                                  const affine_parts<double, 3>& current,
                                  std::span<const correspondence<S>> pairs, kernel_terms terms,
                                  const pair_weigher& weigh, const execution& how) {
  const auto kernels =
      detail::for_target(static_cast<int>(current_vector_target()),
                         []<detail::kernel_target V> { return detail::pair_equations_in<V, S>(); });
  const auto kernel = !weigh         ? kernels.plane
                      : !terms.point ? kernels.weighted_plane
                      : !terms.plane ? kernels.weighted_point
                                     : kernels.weighted_plane_and_point;
  const auto strided = [](const points_view<S, 3>& v) {
    return detail::strided_vectors<S>{v.data(), v.stride()};
  };
  const auto n = std::ssize(pairs);
  std::vector<detail::pair_sums> parts((n + default_block_size - 1) / default_block_size);
  parallel_blocks(n, default_block_size, how, [&](index_t block, index_t begin, index_t end) {
    const detail::matched_points<S> matched{strided(surfaces.source.points),
                                            strided(surfaces.target.points),
                                            strided(surfaces.target.normals),
                                            current.linear.data(),
                                            current.translation.data(),
                                            surfaces.center.data(),
                                            pairs.data() + begin,
                                            sizeof(correspondence<S>),
                                            end - begin};
    const block_weights here{&weigh, begin};
    const detail::pair_weights weights{
        &here, [](const void* context, std::ptrdiff_t first, int count, const double* along,
                  const double* squares, double* plane, double* point) {
          const auto& block_here = *static_cast<const block_weights*>(context);
          const auto some = static_cast<std::size_t>(count);
          (*block_here.weigh)(block_here.begin + first, {along, some}, {squares, some}, plane,
                              point);
        }};
    kernel(matched, weights, parts[block]);
  });

  equation_sums<3, 6> total{3, 6};
  for (const auto& part : parts) {
    total.pairs += static_cast<index_t>(part.pairs);
    total.squared_distance += part.squared_distance;
    if (terms.plane) add_part(total, part.plane);
    if (terms.point) add_part(total, part.point);
  }
  return total;
}
template equation_sums<3, 6> sum_by_kernel(const registered_surfaces<float, 3>&,
                                           const affine_parts<double, 3>&,
                                           std::span<const correspondence<float>>, kernel_terms,
                                           const pair_weigher&, const execution&);
template equation_sums<3, 6> sum_by_kernel(const registered_surfaces<double, 3>&,
                                           const affine_parts<double, 3>&,
                                           std::span<const correspondence<double>>, kernel_terms,
                                           const pair_weigher&, const execution&);

#define CILANTRO_INSTANTIATE(S, D, Metric, Model)                                        \
  template auto sum_equations<S, D, Metric, Model>(                                      \
      const registered_surfaces<S, D>&, const affine_parts<double, D>&,                  \
      std::span<const correspondence<S>>, const Metric&, const Model&, const execution&) \
      -> equation_sums<D, unknowns_of<Model, D>>;
#define CILANTRO_FOR_METRICS(S, D)                          \
  CILANTRO_INSTANTIATE(S, D, point_to_point, rigid_motion)  \
  CILANTRO_INSTANTIATE(S, D, point_to_point, affine_motion) \
  CILANTRO_INSTANTIATE(S, D, point_to_plane, rigid_motion)  \
  CILANTRO_INSTANTIATE(S, D, point_to_plane, affine_motion) \
  CILANTRO_INSTANTIATE(S, D, symmetric, rigid_motion)       \
  CILANTRO_INSTANTIATE(S, D, generalized_icp, rigid_motion)
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_FOR_METRICS)
#undef CILANTRO_FOR_METRICS
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
