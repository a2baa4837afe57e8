// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
module cilantro.search;

namespace cilantro {
namespace {

/// Who has found each node: the transpose, whose rows are by ascending index.
template <Scalar S>
neighborhoods<S> transposed(const neighborhoods<S>& found) {
  std::vector<index_t> offsets(static_cast<std::size_t>(found.size()) + 1);
  for (const std::int32_t j : found.indices()) ++offsets[static_cast<std::size_t>(j) + 1];
  for (std::size_t i = 1; i < offsets.size(); ++i) offsets[i] += offsets[i - 1];
  buffer<std::int32_t> indices(found.indices().size());
  buffer<S> distances(indices.size());
  std::vector<index_t> next(offsets.begin(), offsets.end() - 1);
  for (index_t i = 0; i < found.size(); ++i)
    for (const auto& [j, distance] : found[i]) {
      const auto at = static_cast<std::size_t>(next[j]++);
      indices[at] = static_cast<std::int32_t>(i);
      distances[at] = distance;
    }
  return {std::move(offsets), std::move(indices), std::move(distances)};
}

template <Scalar S>
bool by_index_then_distance(const neighbor<S>& a, const neighbor<S>& b) {
  return std::pair{a.index, a.distance} < std::pair{b.index, b.distance};
}
template <Scalar S>
bool by_distance_then_index(const neighbor<S>& a, const neighbor<S>& b) {
  return std::pair{a.distance, a.index} < std::pair{b.distance, b.index};
}

}  // namespace

template <Scalar S>
void expect_nodes(const neighborhoods<S>& graph, const char* who) {
  expects(graph.size() <= std::numeric_limits<std::int32_t>::max(),
          std::string{who} + ": there can be at most 2^31 - 1 nodes");
  // Without a branch, so that it costs what reading them costs.
  bool all = true;
  for (const std::int32_t j : graph.indices()) all = all & (0 <= j) & (j < graph.size());
  expects(all, std::string{who} + ": a neighbor is not one of the nodes");
}

template <Scalar S>
void by_index(const neighborhood<S>& near, std::vector<neighbor<S>>& out) {
  out.assign(near.begin(), near.end());
  std::ranges::sort(out, by_index_then_distance<S>);
  const auto rest = std::ranges::unique(out, {}, &neighbor<S>::index);
  out.erase(rest.begin(), rest.end());
}

template <Scalar S>
void expect_square(const neighborhoods<S>& graph) {
  expect_nodes(graph, "pair_matrix");
  expects(graph.total() <= std::numeric_limits<std::int32_t>::max(),
          "pair_matrix: there can be at most 2^31 - 1 entries");
}

template <Scalar S>
neighborhoods<S> neighbor_graph(const neighborhoods<S>& found, const graph_options& options) {
  expect_nodes(found, "neighbor_graph");
  const bool symmetric = options.symmetry != graph_symmetry::none;
  const auto finders = symmetric ? transposed(found) : neighborhoods<S>{};
  return gather_neighborhoods<S>(found.size(), {options.threads, options.monitor}, [&] {
    return [&, there = std::vector<neighbor<S>>{}, back = std::vector<neighbor<S>>{}](
               index_t i, std::vector<neighbor<S>>& out) mutable {
      by_index(found[i], there);
      if (symmetric) by_index(finders[i], back);
      const bool is_alone = there.empty() && back.empty();
      const auto less = by_index_then_distance<S>;
      const auto index = &neighbor<S>::index;
      out.clear();
      switch (options.symmetry) {
        case graph_symmetry::none:
          out = there;
          break;
        case graph_symmetry::either: {
          std::ranges::merge(there, back, std::back_inserter(out), less);
          const auto rest = std::ranges::unique(out, {}, index);
          out.erase(rest.begin(), rest.end());
          break;
        }
        case graph_symmetry::both:
          std::ranges::set_intersection(there, back, std::back_inserter(out), {}, index, index);
      }
      std::erase_if(out, [&](const neighbor<S>& n) { return n.index == i; });
      if (options.self && !is_alone) out.push_back({i, 0});
      std::ranges::sort(out, by_distance_then_index<S>);
    };
  });
}

template <Scalar S>
neighborhoods<S> without_self(const neighborhoods<S>& found, index_t max_count) {
  return gather_neighborhoods<S>(found.size(), {.threads = 1}, [&] {
    return [&](index_t i, std::vector<neighbor<S>>& out) {
      out.assign(found[i].begin(), found[i].end());
      std::erase_if(out, [&](const neighbor<S>& n) { return n.index == i; });
      if (std::ssize(out) > max_count) out.resize(max_count);
    };
  });
}

template <Scalar S, int D>
neighborhoods<S> closed_edge_graph(points_view<S, D> points,
                                   const Eigen::Ref<const Eigen::MatrixXi>& simplices,
                                   const execution& how) {
  expects(
      simplices.cols() == 0 ||
          (2 <= simplices.rows() && simplices.rows() <= points.dimension() + 1),
      "edge_graph: simplices are columns of indices, from two, of an edge, to one more than there "
      "are dimensions");
  expects(
      simplices.size() == 0 || (0 <= simplices.minCoeff() && simplices.maxCoeff() < points.size()),
      "edge_graph: an index is not one of a point");
  const auto for_edges = [&](auto&& f) {
    for (index_t m = 0; m < simplices.cols(); ++m)
      for (index_t a = 0; a < simplices.rows(); ++a)
        for (index_t b = 0; b < a; ++b) {
          const std::int32_t i = simplices(b, m), j = simplices(a, m);
          if (is_finite(points[i]) && is_finite(points[j])) f(i, j);
        }
  };
  std::vector<index_t> offsets(static_cast<std::size_t>(points.size()) + 1);
  for_edges([&](std::int32_t i, std::int32_t) { ++offsets[static_cast<std::size_t>(i) + 1]; });
  for (std::size_t i = 1; i < offsets.size(); ++i) offsets[i] += offsets[i - 1];
  buffer<std::int32_t> indices(static_cast<std::size_t>(offsets.back()));
  buffer<S> distances(indices.size());
  std::vector<index_t> next(offsets.begin(), offsets.end() - 1);
  for_edges([&](std::int32_t i, std::int32_t j) {
    const auto at = static_cast<std::size_t>(next[i]++);
    indices[at] = j;
    distances[at] = (points[i] - points[j]).norm();
  });
  return neighbor_graph(
      neighborhoods<S>{std::move(offsets), std::move(indices), std::move(distances)},
      {.threads = how.threads, .monitor = how.monitor});
}

template <Scalar S, int D>
neighborhoods<S> closed_pixel_graph(points_view<S, D> points, const pixel_graph_options& options,
                                    const execution& how) {
  expects(options.max_distance >= 0, "pixel_graph: .max_distance must not be negative or NaN");
  expects(options.width > 0 && points.size() % options.width == 0,
          "pixel_graph: .width must be that of the picture, one point for each pixel");
  const index_t width = options.width;
  return gather_neighborhoods<S>(points.size(), how, [&] {
    return [&](index_t i, std::vector<neighbor<S>>& out) {
      out.clear();
      if (!is_finite(points[i])) return;
      const index_t column = i % width;
      for (const index_t row : {i - width, i, i + width})
        for (index_t side = column > 0 ? -1 : 0; side <= (column + 1 < width ? 1 : 0); ++side) {
          const index_t j = row + side;
          if (j < 0 || j >= points.size() || j == i || !is_finite(points[j])) continue;
          const S distance = (points[i] - points[j]).norm();
          if (double(distance) <= options.max_distance) out.push_back({j, distance});
        }
      std::ranges::sort(out, by_distance_then_index<S>);
    };
  });
}

#define CILANTRO_INSTANTIATE(S)                                                            \
  template void by_index<S>(const neighborhood<S>&, std::vector<neighbor<S>>&);            \
  template void expect_nodes<S>(const neighborhoods<S>&, const char*);                     \
  template void expect_square<S>(const neighborhoods<S>&);                                 \
  template neighborhoods<S> neighbor_graph(const neighborhoods<S>&, const graph_options&); \
  template neighborhoods<S> without_self(const neighborhoods<S>&, index_t);
CILANTRO_INSTANTIATE(float)
CILANTRO_INSTANTIATE(double)
#undef CILANTRO_INSTANTIATE
#define CILANTRO_INSTANTIATE(S, D)                                                            \
  template neighborhoods<S> closed_edge_graph(                                                \
      points_view<S, D>, const Eigen::Ref<const Eigen::MatrixXi>&, const execution&);         \
  template neighborhoods<S> closed_pixel_graph(points_view<S, D>, const pixel_graph_options&, \
                                               const execution&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
