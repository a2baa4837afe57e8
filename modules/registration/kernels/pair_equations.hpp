// SPDX-License-Identifier: MIT
//
// The normal equations of point-to-plane and point-to-point registration in three dimensions,
// compiled for each vector target. Internal.
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

/// Pairs lie `size` bytes apart, each beginning with its source index and its target index. The map
/// moves the source, column by column. There are no normals where no term looks at them.
template <class S>
struct matched_points {
  strided_vectors<S> source, target, normals;
  const double* linear;
  const double* translation;
  const double* center;
  const void* pairs;
  std::size_t pair_size;
  std::ptrdiff_t count;
};

/// Writes how much `count` pairs from `first` on weigh in each of the two terms, given their
/// distances along the normals and their squared distances.
struct pair_weights {
  const void* context;
  void (*weigh)(const void* context, std::ptrdiff_t first, int count, const double* along_normals,
                const double* squared_distances, double* plane_weights, double* point_weights);
};

/// Sums over pairs, weighted. Of symmetric matrices one half, row by row from the diagonal.
struct pair_sums {
  double pairs, squared_distance;  ///< Of all that are finite, without a weight.
  struct plane_term {
    double information[21], gradient[6], place[3], spread[6], weight, squared_residual;
  } plane;
  /// `difference` is Σ w e, and `moment` Σ w y × e, for places y and differences e.
  struct point_term {
    double difference[3], moment[3], place[3], spread[6], weight, squared_residual;
  } point;
};

template <class S>
struct pair_equations {
  using function = void(const matched_points<S>& all, const pair_weights& weights, pair_sums& out);
  function* plane;  ///< All of weight 1.
  function* weighted_plane;
  function* weighted_point;
  function* weighted_plane_and_point;
};

/// What the units for each target instantiate.
template <kernel_target V, class S>
pair_equations<S> pair_equations_in();

}  // namespace cilantro::detail
