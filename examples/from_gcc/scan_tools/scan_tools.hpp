// SPDX-License-Identifier: MIT
//
// What the rest of the program sees: no modules, no Eigen, nothing of cilantro.
#pragma once

#include <array>
#include <stdexcept>
#include <vector>

#define SCAN_TOOLS_EXPORT __attribute__((visibility("default")))

namespace scan_tools {

using point = std::array<float, 3>;

struct surface {
  std::vector<point> points, normals;
};

/// One point for each voxel with edges of `edge` metres, and its normal from `neighbors` points.
/// Throws `std::invalid_argument` where they make no sense.
SCAN_TOOLS_EXPORT surface surface_of(const std::vector<point>& scan, double edge, int neighbors);

}  // namespace scan_tools
