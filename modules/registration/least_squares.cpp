// SPDX-License-Identifier: MIT
module;
#include <array>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "core/closed_spaces.hpp"
module cilantro.registration;

namespace cilantro {

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
