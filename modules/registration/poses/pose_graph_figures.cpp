// SPDX-License-Identifier: MIT
//
// What becomes of a pose graph, in words.
module;
#include <ostream>
module cilantro.registration;

namespace cilantro {

std::string_view to_string(pose_graph_status status) {
  switch (status) {
    case pose_graph_status::converged:
      return "converged";
    case pose_graph_status::iteration_limit:
      return "iteration_limit";
    case pose_graph_status::disconnected:
      return "disconnected";
    case pose_graph_status::degenerate:
      return "degenerate";
    case pose_graph_status::cancelled:
      return "cancelled";
  }
  return "?";
}

std::ostream& operator<<(std::ostream& out, pose_graph_status status) {
  return out << to_string(status);
}

std::string_view to_string(edge_verdict verdict) {
  switch (verdict) {
    case edge_verdict::kept:
      return "kept";
    case edge_verdict::rejected:
      return "rejected";
    case edge_verdict::silent:
      return "silent";
  }
  return "?";
}

std::ostream& operator<<(std::ostream& out, edge_verdict verdict) {
  return out << to_string(verdict);
}

std::vector<index_t> pose_graph_figures::rejected() const {
  std::vector<index_t> numbers;
  for (index_t e = 0; e < std::ssize(edges); ++e)
    if (edges[e].verdict == edge_verdict::rejected) numbers.push_back(e);
  return numbers;
}

std::ostream& operator<<(std::ostream& out, const pose_graph_figures& figures) {
  const auto rejected = figures.rejected();
  out << figures.status << " after " << figures.iterations
      << (figures.iterations == 1 ? " iteration: " : " iterations: ") << figures.component_of.size()
      << " nodes in " << figures.components
      << (figures.components == 1 ? " component, " : " components, ") << figures.edges.size()
      << " edges, " << rejected.size() << " rejected, cost " << figures.cost_at_start << " to "
      << figures.cost;
  if (figures.undetermined > 0) out << ", " << figures.undetermined << " directions undetermined";
  for (const index_t e : rejected)
    out << "\nedge " << e << " from " << figures.edges[e].source << " to "
        << figures.edges[e].target << " rejected: chi-square " << figures.edges[e].chi_square
        << " is above " << figures.chi_square_limit;
  return out;
}

}  // namespace cilantro
