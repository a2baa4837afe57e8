// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
module cilantro.cloud;

namespace cilantro {

#define CILANTRO_INSTANTIATE(S, D)                                                         \
  template point_cloud<S, D> append_parts(std::span<const point_cloud<S, D>* const>);      \
  template point_cloud<S, D> estimate_normals(point_cloud<S, D>, neighborhood_spec,        \
                                              const normals_options&);                     \
  template point_cloud<S, D> voxel_downsample(const point_cloud<S, D>&, const voxel_size&, \
                                              const voxel_downsample_options&);            \
  template point_cloud<S, D> orient_to_viewpoint(point_cloud<S, D>, const coordinates&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
