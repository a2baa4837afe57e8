// SPDX-License-Identifier: MIT
#include "scan_tools.hpp"

#include <cstring>

import cilantro;

namespace scan_tools {
namespace {

std::vector<point> columns_of(const Eigen::Matrix3Xf& matrix) {
  std::vector<point> result(static_cast<std::size_t>(matrix.cols()));
  if (!result.empty()) std::memcpy(result.data(), matrix.data(), result.size() * sizeof(point));
  return result;
}

}  // namespace

surface surface_of(const std::vector<point>& scan, double edge, int neighbors) try {
  // The caller's memory, seen in place.
  const Eigen::Matrix3Xf points = cilantro::voxel_downsample(scan, edge);
  const auto [normals, curvature] =
      cilantro::estimate_normals(points, cilantro::knn{neighbors}, {.viewpoint = {{0, 0, 1}}});
  return {columns_of(points), columns_of(normals)};
} catch (const cilantro::invalid_input& error) {
  // Of a class that the caller knows too.
  throw std::invalid_argument{error.what()};
}

}  // namespace scan_tools
