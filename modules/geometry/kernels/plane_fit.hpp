// SPDX-License-Identifier: MIT
//
// Planes through many small neighbourhoods in three dimensions at once, compiled for each vector
// target. Internal.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/vector_kernels.hpp"

namespace cilantro::detail {

/// Neighbourhoods that are fitted in one call: lanes of a vector.
inline constexpr int planes_at_a_time = 8;
/// The most members of a neighbourhood for which one pass over them is precise.
inline constexpr std::int32_t most_plane_members = 64;

/// Some of `points`, of which consecutive ones are `stride` scalars apart.
template <class S>
struct plane_members {
  const S* points;
  std::ptrdiff_t stride;
  const std::int32_t* indices[planes_at_a_time];
  std::int32_t counts[planes_at_a_time];  ///< At most `most_plane_members`; 0 for none.
};

struct fitted_planes {
  double normals[3][planes_at_a_time];
  double curvatures[planes_at_a_time];
  bool are_determined[planes_at_a_time];
};

template <class S>
using plane_fit = void(const plane_members<S>& members, fitted_planes& out);

/// What the units for each target instantiate.
template <kernel_target V, class S>
plane_fit<S>* plane_fit_in();

}  // namespace cilantro::detail
