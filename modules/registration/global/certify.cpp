// SPDX-License-Identifier: MIT
module;
#include <ostream>

#include "core/closed_spaces.hpp"
module cilantro.registration;

import cilantro.eigen;
import :bit_graph;

namespace cilantro {
namespace {

/// Drops edges that no clique of more than `size` nodes can have: in it, two nodes share `size` − 1
/// others at least. Until there are none, or nothing is left.
void drop_edges_beyond(bit_graph& graph, index_t size, const execution& how) {
  while (
      graph.keep_edges(how, [&](index_t i, index_t j) { return graph.shared(i, j) >= size - 1; })) {
  }
}

/// As many colours suffice that no two neighbours have the same one: a clique has no more nodes.
index_t count_colors(const bit_graph& graph) {
  std::vector<std::vector<std::uint64_t>> classes;
  for (index_t i = 0; i < graph.nodes(); ++i) {
    const std::uint64_t* row = graph.row(i);
    if (std::all_of(row, row + graph.words(), [](std::uint64_t w) { return w == 0; })) continue;
    const auto fits = [&](const std::vector<std::uint64_t>& members) {
      for (index_t w = 0; w < graph.words(); ++w)
        if (members[w] & row[w]) return false;
      return true;
    };
    auto found = std::ranges::find_if(classes, fits);
    if (found == classes.end())
      found = classes.emplace(classes.end(), static_cast<std::size_t>(graph.words()));
    (*found)[i / 64] |= std::uint64_t{1} << (i % 64);
  }
  return std::ssize(classes);
}

}  // namespace

template <Scalar S, int D>
pair_certificate closed_certify(const affine_parts<double, dynamic>& transform,
                                points_view<S, D> source, points_view<S, D> target,
                                const index_list& sources, const index_list& targets,
                                double max_distance, const execution& how) {
  expects(max_distance > 0 && std::isfinite(max_distance),
          "certify: .max_distance is required, and must be finite: how far apart the points of a "
          "right pair may be");
  Eigen::MatrixXd from(source.dimension(), std::ssize(sources)),
      to(target.dimension(), std::ssize(sources));
  index_t count = 0;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const auto s = sources[i], t = targets[i];
    expects(0 <= s && s < source.size() && 0 <= t && t < target.size(),
            "certify: a pair has an index that is not one of a point");
    if (!is_finite(source[s]) || !is_finite(target[t])) continue;
    from.col(count) = source[s].template cast<double>();
    to.col(count++) = target[t].template cast<double>();
  }
  expects(count <= most_graph_pairs,
          "certify: there are too many pairs; give it those that are "
          "left after pruning, such as the inliers of a result");
  pair_certificate found;
  found.pairs = count;
  if (count == 0) return found;
  expects(source.dimension() == target.dimension() &&
              source.dimension() == transform.translation.size(),
          "certify: source, target and transform must have the same dimension");
  for (index_t i = 0; i < count; ++i)
    found.agreeing +=
        (transform.linear * from.col(i) + transform.translation - to.col(i)).norm() <= max_distance;

  // Rounding of lengths must not drop an edge.
  const double slack =
      2 * max_distance * (1 + 1e-9) + 1e-14 * (from.leftCols(count).cwiseAbs().maxCoeff() +
                                               to.leftCols(count).cwiseAbs().maxCoeff());
  bit_graph graph{count,
                  [&](index_t i, std::span<std::uint64_t> row) {
                    for (index_t j = 0; j < count; ++j)
                      if (std::abs((from.col(i) - from.col(j)).norm() -
                                   (to.col(i) - to.col(j)).norm()) <= slack)
                        row[j / 64] |= std::uint64_t{1} << (j % 64);
                  },
                  how};
  drop_edges_beyond(graph, std::max<index_t>(found.agreeing, 1), how);
  found.most = std::max({found.agreeing, count_colors(graph), index_t{1}});
  return found;
}

std::ostream& operator<<(std::ostream& out, const pair_certificate& c) {
  return out << c.agreeing << " of " << c.pairs << " pairs agree, and no transform has more than "
             << c.most;
}

#define CILANTRO_INSTANTIATE(S, D)                                                \
  template pair_certificate closed_certify(                                       \
      const affine_parts<double, dynamic>&, points_view<S, D>, points_view<S, D>, \
      const index_list&, const index_list&, double, const execution&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
