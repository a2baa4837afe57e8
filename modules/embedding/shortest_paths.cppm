// SPDX-License-Identifier: MIT
export module cilantro.embedding:shortest_paths;

import cilantro.standard;
import cilantro.core;
import cilantro.search;

namespace cilantro {

/// The length of the shortest path along the edges of a graph from each node to each other, N × N:
/// column j has those from node j. Infinite where there is none. Edges are walked as they are
/// given, from a node to its neighbours; `neighbor_graph` makes them the same both ways.
/// Throws `invalid_input` for a neighbour that is no node and for a distance that is negative or
/// NaN; `cancelled`. O(N · E log N) and 8 N² bytes.
/// Source: Dijkstra 1959, "A note on two problems in connexion with graphs".
export template <Scalar S>
[[nodiscard]] Eigen::MatrixXd shortest_paths(const neighborhoods<S>& graph,
                                             const execution& how = {});

}  // namespace cilantro
