// SPDX-License-Identifier: MIT
//
// The normal equations of point-to-plane registration in three dimensions, compiled for each vector
// target. Internal.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/vector_kernels.hpp"

namespace cilantro::detail {

/// Vectors in three dimensions, one `stride` scalars after the other.
template <class S>
struct strided_vectors {
  const S* first;
  std::ptrdiff_t stride;
};

/// What the pairs are pairs of, and the map that moves the source, column by column.
template <class S>
struct plane_surfaces {
  strided_vectors<S> source, target, normals;
  const double* linear;
  const double* translation;
  const double* center;
};

/// As `equation_sums`; of symmetric matrices one half, row by row from the diagonal.
struct plane_sums {
  double information[21], gradient[6], place[3], spread[6];
  double weight, squared_residual, squared_distance, pairs;
};

/// Pairs lie `pair_size` bytes apart, each beginning with its source index and its target index.
template <class S>
using plane_equations = void(const plane_surfaces<S>& surfaces, const void* pairs,
                             std::size_t pair_size, std::ptrdiff_t count, plane_sums& out);

#define CILANTRO_DECLARE(target)            \
  namespace target {                        \
  template <class S>                        \
  plane_equations<S>* plane_equations_in(); \
  }
CILANTRO_FOR_VECTOR_TARGETS(CILANTRO_DECLARE)
#undef CILANTRO_DECLARE

}  // namespace cilantro::detail
