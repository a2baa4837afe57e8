// SPDX-License-Identifier: MIT
module;
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "core/closed_spaces.hpp"
#include "registration/plane_equations.hpp"
module cilantro.registration;

namespace cilantro {
namespace {

template <Scalar S>
detail::plane_equations<S>& plane_kernel() {
#define CILANTRO_ENTRY(target) detail::target::plane_equations_in<S>(),
  static detail::plane_equations<S>* const all[] = {CILANTRO_FOR_VECTOR_TARGETS(CILANTRO_ENTRY)};
#undef CILANTRO_ENTRY
  return *all[static_cast<int>(current_vector_target())];
}

}  // namespace

template <Scalar S>
equation_sums<3, 6> sum_plane_equations(const registered_surfaces<S, 3>& surfaces,
                                        const double_map<3>& current,
                                        std::span<const correspondence<S>> pairs,
                                        const execution& how) {
  const auto strided = [](const points_view<S, 3>& v) {
    return detail::strided_vectors<S>{v.data(), v.stride()};
  };
  const detail::plane_surfaces<S> planes{
      strided(surfaces.source.points),  strided(surfaces.target.points),
      strided(surfaces.target.normals), current.linear.data(),
      current.translation.data(),       surfaces.center.data()};
  const auto n = std::ssize(pairs);
  std::vector<detail::plane_sums> parts(
      static_cast<std::size_t>((n + default_block_size - 1) / default_block_size));
  parallel_blocks(n, default_block_size, how, [&](index_t block, index_t begin, index_t end) {
    plane_kernel<S>()(planes, pairs.data() + begin, sizeof(correspondence<S>), end - begin,
                      parts[static_cast<std::size_t>(block)]);
  });

  equation_sums<3, 6> total{3, 6};
  for (const auto& part : parts) {
    total.pairs += static_cast<index_t>(part.pairs);
    total.weight += part.weight;
    total.seen += part.weight;
    total.squared_residual += part.squared_residual;
    total.squared_distance += part.squared_distance;
    const double* next = part.information;
    for (index_t a = 0; a < 6; ++a) {
      total.gradient[a] += part.gradient[a];
      for (index_t b = a; b < 6; ++b) total.information(b, a) += *next++;
    }
    next = part.spread;
    for (index_t a = 0; a < 3; ++a) {
      total.place[a] += part.place[a];
      for (index_t b = a; b < 3; ++b, ++next) {
        total.spread(a, b) += *next;
        if (a != b) total.spread(b, a) += *next;
      }
    }
  }
  return total;
}
template equation_sums<3, 6> sum_plane_equations(const registered_surfaces<float, 3>&,
                                                 const double_map<3>&,
                                                 std::span<const correspondence<float>>,
                                                 const execution&);
template equation_sums<3, 6> sum_plane_equations(const registered_surfaces<double, 3>&,
                                                 const double_map<3>&,
                                                 std::span<const correspondence<double>>,
                                                 const execution&);

#define CILANTRO_INSTANTIATE(S, D, Metric, Model)                                                 \
  template auto sum_equations<S, D, Metric, Model>(                                               \
      const registered_surfaces<S, D>&, const double_map<D>&, std::span<const correspondence<S>>, \
      const Metric&, const Model&, const execution&) -> equation_sums<D, unknowns_of<Model, D>>;
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
