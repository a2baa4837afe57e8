// SPDX-License-Identifier: MIT
//
// Sets as `align_globally` describes them.
module cilantro.registration:surface_description;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;
import cilantro.geometry;
import :align_globally;
import :surface_check;

namespace cilantro {

struct surface_description {
  double voxel = 0;
  bool oriented = false;  ///< Whether the signs of normals mean something.
  std::optional<voxel_surface<2>> flat;
  std::optional<voxel_surface<3>> solid;
};

/// An input in a dimension that is known, if there are points, to be E.
template <int E, Scalar S>
global_input<S, E> fixed_input(const global_input<S, dynamic>& input) {
  const auto fixed = [](const points_view<S, dynamic>& v) {
    return v.empty() ? points_view<S, E>{} : points_view<S, E>{v.data(), v.size(), v.stride()};
  };
  return {fixed(input.points), fixed(input.normals), input.anchor};
}

/// The voxels of a set, without features.
template <Scalar S, int D>
voxel_surface<D> reduced_to_voxels(const global_input<S, D>& input, const surface_options& options);

}  // namespace cilantro
