// SPDX-License-Identifier: MIT
//
// Histograms of the angles between pairs of normals, compiled for each vector target. Internal.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/vector_kernels.hpp"

namespace cilantro::detail {

/// The histograms of a point: three of 11 bins, and a place for what has no angles; filled up so
/// that columns are aligned.
inline constexpr int histogram_bins = 11, histogram_values = 33, histogram_stride = 36;

/// A point and its normal, relative to some origin; the normal is zero if it is unknown.
struct surface_point {
  float point[3];
  float normal[3];
};

struct pair_features {
  /// Adds the pairs of `center` with each of `count` points to the `counts` of the bins: θ, α, φ.
  /// If not `oriented`, the normals of neighbours are turned to the side of that of the centre.
  void (*count)(const surface_point* all, const surface_point& center, const std::int32_t* near,
                std::ptrdiff_t count, bool oriented, std::int32_t* counts);
  /// Adds `weights[i]` times histogram `near[i]`, mirrored where `mirrored[i]`, to `sum`.
  void (*blend)(const float* histograms, const std::int32_t* near, const float* weights,
                const std::uint8_t* mirrored, std::ptrdiff_t count, float* sum);
};

/// What the units for each target instantiate.
template <kernel_target V>
const pair_features& pair_features_in();

}  // namespace cilantro::detail
