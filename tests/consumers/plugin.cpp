// SPDX-License-Identifier: MIT
//
// What is called from elsewhere, and has cilantro inside.
import cilantro;

extern "C" long voxels(const float* xyz, long count, double edge) {
  return static_cast<long>(
      cilantro::voxel_downsample(cilantro::points_view<float, 3>{xyz, count}, edge).cols());
}
