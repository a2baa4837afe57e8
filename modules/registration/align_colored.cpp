// SPDX-License-Identifier: MIT
//
// The instantiations of registration by colours, in a unit of their own beside those of `align`.
module;
#include "core/closed_spaces.hpp"
module cilantro.registration;

namespace cilantro {

#define CILANTRO_INSTANTIATE(S, D)                                                \
  template icp_result<rigid_transform<S, D>> align_colored<rigid_motion, S, D>(   \
      const align_input<S, D>&, const align_input<S, D>&, const colored&,         \
      const align_start<rigid_transform<S, D>>&, const align_options&);           \
  template icp_result<affine_transform<S, D>> align_colored<affine_motion, S, D>( \
      const align_input<S, D>&, const align_input<S, D>&, const colored&,         \
      const align_start<affine_transform<S, D>>&, const align_options&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
