// SPDX-License-Identifier: MIT
export module cilantro.embedding:shortest_paths;

import cilantro.standard;
import cilantro.core;
import cilantro.search;

namespace cilantro {

/// The lengths of the shortest paths along the edges of a graph between all nodes, N × N: column j
/// holds those from node j; infinite where there is no path. Edges are directed, from a node to its
/// neighbours; `neighbor_graph` makes them symmetric. Throws `invalid_input` for a neighbour that
/// is not a node, and for a distance that is negative or NaN; `cancelled`. O(N · E log N) and 8 N²
/// bytes.
/// Source: Dijkstra 1959, "A note on two problems in connexion with graphs".
export template <Scalar S>
[[nodiscard]] Eigen::MatrixXd shortest_paths(const neighborhoods<S>& graph,
                                             const execution& how = {});

}  // namespace cilantro
