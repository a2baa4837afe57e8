// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
module cilantro.warp;

namespace cilantro {

void expect_valid(const warp_options& options, bool is_rigid) {
  constexpr double most = std::numeric_limits<double>::max();
  expect_between(0, options.stiffness, most_stiffness, "warp_options: stiffness");
  expect_between(0, options.rigidity, most, "warp_options: rigidity");
  expects(!is_rigid || options.rigidity == 0,
          "warp_options: rigid motions need no .rigidity, which is for those that may deform");
  expects(!options.smoothness || options.regularizer == warp_regularizer::shape,
          "warp_options: .smoothness is of the disagreement of nodes, which increments begin "
          "without");
  expect_from(0, options.threads, "warp_options: threads");
}

template <Scalar S, int D>
node_lists lists_of_nodes(const deformation_graph_data<S, D>& graph, bool with_rigidity) {
  node_lists lists;
  for (index_t g = 0; g < graph.group_count(); ++g) lists.add(graph.anchors_of(g));
  for (const auto& [a, b] : graph.links) lists.add(std::array{a, b});
  if (with_rigidity)
    for (std::int32_t node = 0; node < graph.nodes.cols(); ++node) lists.add(std::array{node});
  return lists;
}

#define CILANTRO_INSTANTIATE(S, D)                                               \
  template node_lists lists_of_nodes(const deformation_graph_data<S, D>&, bool); \
  template class warp_engine<S, D, rigid_motion>;                                \
  template class warp_engine<S, D, affine_motion>;
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
