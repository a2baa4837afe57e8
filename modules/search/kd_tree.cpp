// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
module cilantro.search;

namespace cilantro {

#define CILANTRO_INSTANTIATE(S, D)                \
  template class kd_tree_engine<S, D, euclidean>; \
  template class kd_tree_engine<S, D, manhattan>; \
  template class kd_tree_engine<S, D, chebyshev>; \
  template class kd_tree_engine<S, D, so2>;
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE
// Of four coordinates, which the library is not compiled for: as a run-time dimension.
template class kd_tree_engine<float, dynamic, so3>;
template class kd_tree_engine<double, dynamic, so3>;

}  // namespace cilantro
