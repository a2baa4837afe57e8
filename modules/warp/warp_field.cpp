// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
#include "warp/kernels/move_by_anchors.hpp"
module cilantro.warp;

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
                          const point_vector<double, D>& p, const linear_normalizer& normalize) {
  const auto near = anchors_at<S, D>(graph, p.template cast<S>());
  local_motion<D> local{blended<S, D>::linear(motions, near.nodes(), near.weights()),
                        blended<S, D>::place(graph, motions, near.nodes(), near.weights(), p)};
  if (normalize) local.linear = normalize(local.linear);
  return local;
}

}  // namespace

template <Scalar S, int D>
void move_group(const deformation_graph_data<S, D>& graph, const node_motions<D>& motions,
                points_view<S, D> points, index_t group, bool with_offsets, moved_group& out) {
  const index_t d = motions.shifts.rows();
  const std::int32_t* const indices = graph.points_of(group).data();
  const index_t count = std::ssize(graph.points_of(group));
  const double* const weights = graph.weights_at(graph.groups[group]);
  const auto nodes = graph.anchors_of(group);
  const index_t anchors = std::ssize(nodes);
  out.anchors = anchors;
  out.stride = D == 3 ? detail::place_stride : d;
  if (const auto size = static_cast<std::size_t>(count * out.stride); out.places.size() < size)
    out.places.resize(2 * size);
  if (const auto size = static_cast<std::size_t>(count * anchors * out.stride);
      with_offsets && out.offsets.size() < size)
    out.offsets.resize(2 * size);

  if constexpr (D == 3) {
    std::array<detail::node_frame, most_anchors> frames;
    for (index_t k = 0; k < anchors; ++k) {
      auto& [before, after, linear] = frames[k] = {};
      for (index_t i = 0; i < 3; ++i) {
        before[i] = static_cast<double>(graph.nodes(i, nodes[k]));
        after[i] = before[i] + motions.shifts(i, nodes[k]);
      }
      for (index_t j = 0; j < 3; ++j)
        std::copy_n(motions.linear.data() + 9 * index_t(nodes[k]) + 3 * j, 3,
                    linear + detail::place_stride * j);
    }
    const auto move = detail::for_target(
        static_cast<int>(current_vector_target()),
        []<detail::kernel_target V> { return detail::move_by_anchors_in<V, S>(); });
    move({points.data(), points.stride(), indices, weights, graph.anchors_per_point, count,
          frames.data(), static_cast<int>(anchors)},
         out.places.data(), with_offsets ? out.offsets.data() : nullptr);
  } else {
    for (index_t i = 0; i < count; ++i) {
      const double* const own = weights + i * graph.anchors_per_point;
      Eigen::Map<point_vector<double, D>> place{out.places.data() + i * d, d};
      place.setZero();
      const point_vector<double, D> p = points[indices[i]].template cast<double>();
      for (index_t k = 0; k < anchors; ++k) {
        const point_vector<double, D> node = graph.nodes.col(nodes[k]).template cast<double>();
        const auto offset = blended<S, D>::offset_from(motions, nodes[k], node, p);
        place += own[k] * (offset + (node + motions.shifts.col(nodes[k])));
        if (with_offsets) std::copy_n(offset.data(), d, out.offsets.data() + (i * anchors + k) * d);
      }
    }
  }
}

template <Scalar S, int D>
void move_groups(const deformation_graph_data<S, D>& graph, const node_motions<D>& motions,
                 points_view<S, D> points, mutable_points_view<S, D> out, const execution& how) {
  const index_t d = motions.shifts.rows();
  for (index_t i = 0; i < out.size(); ++i)
    if (graph.group_of[i] < 0) out[i] = points[i];
  parallel_blocks(graph.group_count(), 64, how, [&](index_t, index_t begin, index_t end) {
    moved_group moved;
    for (index_t group = begin; group < end; ++group) {
      move_group(graph, motions, points, group, false, moved);
      for (index_t i = graph.groups[group]; i < graph.groups[group + 1]; ++i)
        out[graph.order[i]] =
            moved.template place<D>(i - graph.groups[group], d).template cast<S>();
    }
  });
}

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
    const auto local = motion_at<S, D>(graph, motions, p, {});
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
                                  const linear_normalizer& normalize) {
  node_motions<D> result{index_t(nodes.rows()), index_t(nodes.cols())};
  for (index_t k = 0; k < nodes.cols(); ++k) {
    const point_vector<double, D> node = nodes.col(k).template cast<double>();
    const auto local = motion_at<S, D>(from, motions, node, normalize);
    result.linear_of(k) = local.linear;
    result.shifts.col(k) = local.place - node;
  }
  return result;
}

template <Scalar S, int D>
node_motions<D> composed_motions(const deformation_graph_data<S, D>& outer_graph,
                                 const node_motions<D>& outer,
                                 const deformation_graph_data<S, D>& inner_graph,
                                 const node_motions<D>& inner, const linear_normalizer& normalize) {
  node_motions<D> result = inner;
  for (index_t k = 0; k < inner_graph.nodes.cols(); ++k) {
    const point_vector<double, D> node = inner_graph.nodes.col(k).template cast<double>();
    const auto local = motion_at<S, D>(outer_graph, outer, node + inner.shifts.col(k), normalize);
    result.linear_of(k) = local.linear * inner.linear_of(k);
    result.shifts.col(k) = local.place - node;
  }
  return result;
}

#define CILANTRO_INSTANTIATE(S, D)                                                              \
  template void move_group(const deformation_graph_data<S, D>&, const node_motions<D>&,         \
                           points_view<S, D>, index_t, bool, moved_group&);                     \
  template void move_groups(const deformation_graph_data<S, D>&, const node_motions<D>&,        \
                            points_view<S, D>, mutable_points_view<S, D>, const execution&);    \
  template std::optional<point_vector<double, D>> invert_field(                                 \
      const deformation_graph_data<S, D>&, const node_motions<D>&,                              \
      const point_vector<double, D>&);                                                          \
  template node_motions<D> resampled_motions(const deformation_graph_data<S, D>&,               \
                                             const node_motions<D>&, const point_matrix<S, D>&, \
                                             const linear_normalizer&);                         \
  template node_motions<D> composed_motions(                                                    \
      const deformation_graph_data<S, D>&, const node_motions<D>&,                              \
      const deformation_graph_data<S, D>&, const node_motions<D>&, const linear_normalizer&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
