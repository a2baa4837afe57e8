// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

#include "core/closed_spaces.hpp"
module cilantro.registration;

namespace cilantro {
namespace {

/// What a field does to a place and around it.
template <int D>
struct local_motion {
  Eigen::Matrix<double, D, D> linear;
  point_vector<double, D> place;
};

template <Scalar S, int D>
local_motion<D> motion_at(const deformation_graph_data<S, D>& graph, const node_motions<D>& motions,
                          const point_vector<double, D>& p, bool is_rigid) {
  const point_vector<S, D> rounded = p.template cast<S>();
  const auto [nodes, weights] = anchors_at<S, D>(graph, rounded);
  local_motion<D> local{blended<S, D>::linear(motions, nodes, weights),
                        blended<S, D>::place(graph, motions, nodes, weights, p)};
  if (is_rigid) local.linear = nearest_rotation(local.linear);
  return local;
}

}  // namespace

template <Scalar S, int D>
std::optional<point_vector<double, D>> invert_field(const deformation_graph_data<S, D>& graph,
                                                    const node_motions<D>& motions,
                                                    const point_vector<double, D>& place) {
  // From what the node that ends nearest to the place says.
  index_t start = -1;
  double nearest = std::numeric_limits<double>::infinity();
  for (index_t k = 0; k < graph.nodes.cols(); ++k) {
    const double square =
        (graph.nodes.col(k).template cast<double>() + motions.shifts.col(k) - place).squaredNorm();
    if (square < nearest) {
      nearest = square;
      start = k;
    }
  }
  if (start < 0) return std::nullopt;
  const point_vector<double, D> node = graph.nodes.col(start).template cast<double>();
  const double size = std::sqrt(nearest) + node.norm() + place.norm();
  const double exact = 8 * size * double(std::numeric_limits<S>::epsilon());
  point_vector<double, D> p = node;
  double last = std::numeric_limits<double>::infinity();
  constexpr int most_steps = 50;
  for (int step = 0; step < most_steps; ++step) {
    const auto local = motion_at<S, D>(graph, motions, p, false);
    const point_vector<double, D> rest = place - local.place;
    const double now = rest.norm();
    if (now <= exact) return p;
    if (!(now < 2 * last)) return std::nullopt;
    last = std::min(last, now);
    const auto back = solve(local.linear, rest);
    if (!back) return std::nullopt;
    p += *back;
  }
  return std::nullopt;
}

template <Scalar S, int D>
node_motions<D> resampled_motions(const deformation_graph_data<S, D>& from,
                                  const node_motions<D>& motions, const point_matrix<S, D>& nodes,
                                  bool is_rigid) {
  node_motions<D> result{index_t(nodes.rows()), index_t(nodes.cols())};
  for (index_t k = 0; k < nodes.cols(); ++k) {
    const point_vector<double, D> node = nodes.col(k).template cast<double>();
    const auto local = motion_at<S, D>(from, motions, node, is_rigid);
    result.linear_of(k) = local.linear;
    result.shifts.col(k) = local.place - node;
  }
  return result;
}

template <Scalar S, int D>
node_motions<D> composed_motions(const deformation_graph_data<S, D>& outer_graph,
                                 const node_motions<D>& outer,
                                 const deformation_graph_data<S, D>& inner_graph,
                                 const node_motions<D>& inner, bool is_rigid) {
  node_motions<D> result = inner;
  for (index_t k = 0; k < inner_graph.nodes.cols(); ++k) {
    const point_vector<double, D> node = inner_graph.nodes.col(k).template cast<double>();
    const auto local = motion_at<S, D>(outer_graph, outer, node + inner.shifts.col(k), is_rigid);
    result.linear_of(k) = local.linear * inner.linear_of(k);
    result.shifts.col(k) = local.place - node;
  }
  return result;
}

#define CILANTRO_INSTANTIATE(S, D)                                                              \
  template std::optional<point_vector<double, D>> invert_field(                                 \
      const deformation_graph_data<S, D>&, const node_motions<D>&,                              \
      const point_vector<double, D>&);                                                          \
  template node_motions<D> resampled_motions(const deformation_graph_data<S, D>&,               \
                                             const node_motions<D>&, const point_matrix<S, D>&, \
                                             bool);                                             \
  template node_motions<D> composed_motions(                                                    \
      const deformation_graph_data<S, D>&, const node_motions<D>&,                              \
      const deformation_graph_data<S, D>&, const node_motions<D>&, bool);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
