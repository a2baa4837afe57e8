// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
export module cilantro.warp:warp_field;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import cilantro.registration;
import :deformation_graph;

namespace cilantro {

/// The motions of all nodes in double, in a dimension that the library is compiled for: node k
/// moves a point p to linear · (p − node) + node + shift.
template <int D>
struct node_motions {
  using matrix = Eigen::Matrix<double, D, D>;
  using vector = point_vector<double, D>;
  Eigen::Matrix<double, D, dynamic> linear;  ///< `Dim` columns for each node.
  Eigen::Matrix<double, D, dynamic> shifts;  ///< One column for each node.

  node_motions() = default;
  node_motions(index_t dimension, index_t nodes)
      : linear{Eigen::MatrixXd::Identity(dimension, dimension).replicate(1, nodes)},
        shifts{Eigen::MatrixXd::Zero(dimension, nodes)} {}

  [[nodiscard]] auto linear_of(index_t k) const {
    return linear.template middleCols<D>(k * shifts.rows(), shifts.rows());
  }
  [[nodiscard]] auto linear_of(index_t k) {
    return linear.template middleCols<D>(k * shifts.rows(), shifts.rows());
  }
};

/// Where a field moves points, blended from the nodes around them.
template <Scalar S, int D>
struct blended {
  using matrix = Eigen::Matrix<double, D, D>;
  using vector = point_vector<double, D>;

  /// linear · (p − node), in the order in which the kernel adds, so that both give the same bits.
  static vector offset_from(const node_motions<D>& motions, std::int32_t k, const vector& node,
                            const vector& p) {
    vector offset = motions.linear_of(k).col(0) * (p[0] - node[0]);
    for (index_t axis = 1; axis < p.size(); ++axis)
      offset += motions.linear_of(k).col(axis) * (p[axis] - node[axis]);
    return offset;
  }
  /// Without nodes, a point stays.
  static vector place(const deformation_graph_data<S, D>& graph, const node_motions<D>& motions,
                      std::span<const std::int32_t> nodes, std::span<const double> weights,
                      const vector& p) {
    if (nodes.empty()) return p;
    vector sum = vector::Zero(p.size());
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const vector node = graph.nodes.col(nodes[k]).template cast<double>();
      const vector after = node + motions.shifts.col(nodes[k]);
      const vector offset = offset_from(motions, nodes[k], node, p);
      sum += weights[k] * (offset + after);
    }
    return sum;
  }
  static matrix linear(const node_motions<D>& motions, std::span<const std::int32_t> nodes,
                       std::span<const double> weights) {
    const index_t d = motions.shifts.rows();
    if (nodes.empty()) return matrix::Identity(d, d);
    matrix sum = matrix::Zero(d, d);
    for (std::size_t k = 0; k < nodes.size(); ++k) sum += weights[k] * motions.linear_of(nodes[k]);
    return sum;
  }
};

/// The direction, of any length, to which a linear map turns the normal of what it maps: its
/// inverse transpose, but for a factor.
template <int D>
[[nodiscard]] point_vector<double, D> turned_normal(const Eigen::Matrix<double, D, D>& linear,
                                                    const point_vector<double, D>& n) {
  if constexpr (D == 2) {
    return {linear(1, 1) * n[0] - linear(1, 0) * n[1], linear(0, 0) * n[1] - linear(0, 1) * n[0]};
  } else if constexpr (D == 3) {
    const Eigen::Vector3d x = linear.col(0), y = linear.col(1), z = linear.col(2);
    return y.cross(z) * n[0] + z.cross(x) * n[1] + x.cross(y) * n[2];
  } else {
    return checked_inverse(linear, "warp_field: the field flattens its points").transpose() * n;
  }
}

/// Where the points of a group go, and what each of their anchors makes of them: linear · (p −
/// node). The numbers of a vector lie next to each other, and vectors `stride` numbers apart.
struct moved_group {
  index_t stride = 0, anchors = 0;
  std::vector<double> places, offsets;

  template <int D>
  [[nodiscard]] auto place(index_t i, index_t dimension) const {
    return Eigen::Map<const point_vector<double, D>>{places.data() + i * stride, dimension};
  }
  template <int D>
  [[nodiscard]] auto offset(index_t i, index_t anchor, index_t dimension) const {
    return Eigen::Map<const point_vector<double, D>>{
        offsets.data() + (i * anchors + anchor) * stride, dimension};
  }
};
/// Moves a group of the graph's points, which lie at `points`.
template <Scalar S, int D>
void move_group(const deformation_graph_data<S, D>& graph, const node_motions<D>& motions,
                points_view<S, D> points, index_t group, bool with_offsets, moved_group& out);
/// Moves all of them to `out`. Those without anchors stay.
template <Scalar S, int D>
void move_groups(const deformation_graph_data<S, D>& graph, const node_motions<D>& motions,
                 points_view<S, D> points, mutable_points_view<S, D> out, const execution& how);

/// The point that a field moves to `place`, if the iteration for it converges.
template <Scalar S, int D>
[[nodiscard]] std::optional<point_vector<double, D>> invert_field(
    const deformation_graph_data<S, D>& graph, const node_motions<D>& motions,
    const point_vector<double, D>& place);

/// Makes a linear part one of its motion model again; empty if any is one.
using linear_normalizer = std::function<Eigen::MatrixXd(const Eigen::MatrixXd&)>;
template <MotionModel Motion>
[[nodiscard]] linear_normalizer normalizer_of() {
  if constexpr (requires(const Motion& motion, const Eigen::MatrixXd& m) { motion.normalize(m); })
    return [](const Eigen::MatrixXd& linear) { return Motion{}.normalize(linear); };
  else
    return {};
}

/// The motions of other nodes, from what a field does to them and around them.
template <Scalar S, int D>
[[nodiscard]] node_motions<D> resampled_motions(const deformation_graph_data<S, D>& from,
                                                const node_motions<D>& motions,
                                                const point_matrix<S, D>& nodes,
                                                const linear_normalizer& normalize);
/// First `inner`, then `outer`, at the nodes of `inner`.
template <Scalar S, int D>
[[nodiscard]] node_motions<D> composed_motions(const deformation_graph_data<S, D>& outer_graph,
                                               const node_motions<D>& outer,
                                               const deformation_graph_data<S, D>& inner_graph,
                                               const node_motions<D>& inner,
                                               const linear_normalizer& normalize);

/// A map of points that bends: every node of a graph has a motion of its own, by which it moves the
/// points around it. Point p of the graph goes to Σ w · (R · (p − g) + g + t), over its anchors g
/// with their weights w, rotations (or linear parts) R and shifts t. A `PointMap`, and a
/// `NormalMap`, of the graph's points; `at` moves any other. A value; copies share the graph.
/// Source: Sumner, Schmid & Pauly 2007, "Embedded deformation for shape manipulation", equation 1.
export template <Scalar S, int D, MotionModel Motion = rigid_motion>
class warp_field {
 public:
  using Scalar = S;
  using motion_model = Motion;
  using graph_type = deformation_graph<S, D>;
  using transform_type = transform_of<Motion, double, D>;

  /// A field of no points.
  warp_field() = default;
  /// The identity.
  explicit warp_field(graph_type graph)
      : graph_{std::move(graph)}, motions_{graph_.dimension(), graph_.nodes().size()} {}

  /// The nodes, and which points they move.
  [[nodiscard]] const graph_type& graph() const [[clang::lifetimebound]] { return graph_; }
  /// The number of points that the field moves.
  [[nodiscard]] index_t size() const { return graph_.size(); }
  [[nodiscard]] index_t dimension() const { return graph_.dimension(); }

  /// Where point i of the graph goes, which lies at p. Precondition: 0 <= i < size().
  [[nodiscard]] point_vector<S, D> operator()(index_t i, const point_vector<S, D>& p) const {
    return blend::place(graph_.data(), motions_, graph_.anchors(i), graph_.weights(i),
                        p.template cast<double>())
        .template cast<S>();
  }
  /// The direction to which the normal n of point i is turned, of any length: by the inverse
  /// transpose of the blended linear part. Precondition: 0 <= i < size().
  [[nodiscard]] point_vector<S, D> normal(index_t i, const point_vector<S, D>& n) const {
    return turned(graph_.anchors(i), graph_.weights(i), n);
  }

  /// The same for all points of the graph, which lie at `points`, faster than one by one. Throws
  /// `invalid_input` unless points and output have the size of the graph's points.
  void move_all(points_view<S, D> points, mutable_points_view<S, D> out,
                const execution& how = {}) const {
    for (const index_t count : {points.size(), out.size()})
      expects(count == size(), "warp_field: there must be one point for each of the graph's");
    if (size() == 0) return;
    expects(points.dimension() == dimension() && out.dimension() == dimension(),
            "warp_field: the points are of another dimension");
    move_groups<S, C>(graph_.data(), motions_, points_view<S, C>{points},
                      mutable_points_view<S, C>{out}, how);
  }

  /// Where any point goes, with the nodes nearest in space as its anchors; out of their reach,
  /// with the nearest alone. One that is not finite stays. O(log nodes).
  [[nodiscard]] point_vector<S, D> at(const point_ref<S, D>& p) const {
    const auto near = anchors_near(p);
    return blend::place(graph_.data(), motions_, near.nodes(), near.weights(),
                        p.template cast<double>())
        .template cast<S>();
  }
  /// The direction to which a normal at any point is turned.
  [[nodiscard]] point_vector<S, D> normal_at(const point_ref<S, D>& p,
                                             const point_ref<S, D>& n) const {
    const auto near = anchors_near(p);
    return turned(near.nodes(), near.weights(), n);
  }
  /// The point that `at` moves to `place`; nothing if none is found, as where the field folds.
  [[nodiscard]] std::optional<point_vector<S, D>> inverse_at(const point_ref<S, D>& place) const {
    if (!is_finite(place)) return std::nullopt;
    if (graph_.nodes().empty()) return point_vector<S, D>{place};
    const auto found = invert_field<S, C>(graph_.data(), motions_, place.template cast<double>());
    if (!found) return std::nullopt;
    return point_vector<S, D>{found->template cast<S>()};
  }

  /// The motion of node k, as a map of points. Throws `invalid_input` unless 0 <= k <
  /// graph().nodes().size().
  [[nodiscard]] transform_type at_node(index_t k) const {
    expect_node(k);
    const vector node = graph_.data().nodes.col(k).template cast<double>();
    return make_transform<transform_type>(
        motions_.linear_of(k),
        (node + motions_.shifts.col(k) - motions_.linear_of(k) * node).eval());
  }
  /// Gives node k a motion. Throws `invalid_input` unless 0 <= k < graph().nodes().size(), and for
  /// a motion of another dimension.
  void set_node(index_t k, const transform_type& motion) {
    expect_node(k);
    expect_coordinates(index_t(motion.translation().size()), dimension());
    const vector node = graph_.data().nodes.col(k).template cast<double>();
    motions_.linear_of(k) = motion.linear();
    motions_.shifts.col(k) = motion.linear() * node + motion.translation() - node;
  }

  /// For the library.
  [[nodiscard]] const auto& motions() const [[clang::lifetimebound]] { return motions_; }
  [[nodiscard]] auto& motions() [[clang::lifetimebound]] { return motions_; }

 private:
  static constexpr int C = closed_dimension<D>;
  using blend = blended<S, C>;
  using vector = point_vector<double, C>;

  void expect_node(index_t k) const {
    expects(0 <= k && k < graph_.nodes().size(), "warp_field: there is no such node");
  }
  [[nodiscard]] point_anchors anchors_near(const point_ref<S, D>& p) const {
    expects(graph_.nodes().empty() || p.size() == dimension(),
            "warp_field: the point is of another dimension");
    return graph_.nodes().empty() ? point_anchors{} : anchors_at<S, C>(graph_.data(), p);
  }
  [[nodiscard]] point_vector<S, D> turned(std::span<const std::int32_t> nodes,
                                          std::span<const double> weights,
                                          const point_vector<S, D>& n) const {
    if (nodes.empty()) return n;
    return turned_normal<C>(blend::linear(motions_, nodes, weights), n.template cast<double>())
        .template cast<S>();
  }

  graph_type graph_;
  node_motions<C> motions_;
};

/// The field that moves nothing.
export template <MotionModel Motion = rigid_motion, Scalar S, int D>
[[nodiscard]] warp_field<S, D, Motion> identity_field(const deformation_graph<S, D>& graph) {
  return warp_field<S, D, Motion>{graph};
}

/// The same motion by the nodes of another graph, which may be finer or move other points. Between
/// the nodes of a coarse field, motions are blended, and normalised if their model can be, as
/// rotations.
/// Throws `invalid_input` for graphs of different dimension. O(nodes · log nodes).
export template <Scalar S, int D, MotionModel Motion>
[[nodiscard]] warp_field<S, D, Motion> resample(
    const warp_field<S, D, Motion>& field,
    const std::type_identity_t<deformation_graph<S, D>>& graph) {
  warp_field<S, D, Motion> result{graph};
  if (graph.nodes().empty() || field.graph().nodes().empty()) return result;
  expects(graph.dimension() == field.dimension(),
          "resample: field and graph must have the same dimension");
  result.motions() = resampled_motions(field.graph().data(), field.motions(), graph.data().nodes,
                                       normalizer_of<Motion>());
  return result;
}

/// The field that moves points by `inner`, then by `outer`, with the graph of `inner`. Exact at its
/// nodes, and blended between them. Throws `invalid_input` for fields of different dimension.
export template <Scalar S, int D, MotionModel Motion>
[[nodiscard]] warp_field<S, D, Motion> compose(const warp_field<S, D, Motion>& outer,
                                               const warp_field<S, D, Motion>& inner) {
  warp_field<S, D, Motion> result{inner};
  if (inner.graph().nodes().empty() || outer.graph().nodes().empty()) return result;
  expects(outer.dimension() == inner.dimension(),
          "compose: the fields must have the same dimension");
  result.motions() = composed_motions(outer.graph().data(), outer.motions(), inner.graph().data(),
                                      inner.motions(), normalizer_of<Motion>());
  return result;
}

/// The cloud, bent by a field: points and normals are moved, and every attribute is kept. The
/// points of the field's own graph have its anchors; any other cloud is moved by the nodes nearest
/// to each of its points, as `at` does. Coordinates are those of the graph: the cloud's origin says
/// nothing, and is kept. Points that are not finite stay. Throws `invalid_input` for a cloud of
/// another dimension.
export template <Scalar S, int D, MotionModel Motion>
[[nodiscard]] point_cloud<S, D> warp(point_cloud<S, D> cloud, const warp_field<S, D, Motion>& field,
                                     const execution& how = {}) {
  expect_consistent(cloud, "warp");
  if (cloud.empty() || field.graph().nodes().empty()) return cloud;
  expects(index_t(cloud.points.rows()) == field.dimension(),
          "warp: cloud and field must have the same dimension");
  const bool is_own = field.graph().is_of(cloud.points);
  parallel_for(cloud.size(), how, [&](index_t i) {
    const point_vector<S, D> p = cloud.points.col(i);
    if (!is_finite(p)) return;
    if (cloud.has_normals()) {
      const point_vector<S, D> n = cloud.normals.col(i);
      point_vector<S, D> turned = is_own ? field.normal(i, n) : field.normal_at(p, n);
      if (const S length = turned.norm(); length > 0) turned /= length;
      cloud.normals.col(i) = turned;
    }
    cloud.points.col(i) = is_own ? field(i, p) : field.at(p);
  });
  return cloud;
}

/// `warp` of clouds as a step. Members are its arguments: `field` and `how`.
export template <Scalar S, int D, MotionModel Motion>
struct warp_step : pipeline_step {
  warp_field<S, D, Motion> field;
  execution how;

  static constexpr const char* name = "warp";
  warp_step(warp_field<S, D, Motion> by, execution with)
      : field(std::move(by)), how(std::move(with)) {}
  /// It looks at nothing but each point.
  static step_reach reach() { return {}; }
  point_cloud<S, D> operator()(point_cloud<S, D> cloud) const {
    return warp(std::move(cloud), field, how);
  }
};
/// The step that bends clouds by `field`.
export template <Scalar S, int D, MotionModel Motion>
[[nodiscard]] auto warp(warp_field<S, D, Motion> field, execution how = {}) {
  return warp_step<S, D, Motion>{std::move(field), std::move(how)};
}

#define CILANTRO_COMPILED_ELSEWHERE(S, D)                                                       \
  extern template void move_group(const deformation_graph_data<S, D>&, const node_motions<D>&,  \
                                  points_view<S, D>, index_t, bool, moved_group&);              \
  extern template void move_groups(const deformation_graph_data<S, D>&, const node_motions<D>&, \
                                   points_view<S, D>, mutable_points_view<S, D>,                \
                                   const execution&);                                           \
  extern template std::optional<point_vector<double, D>> invert_field(                          \
      const deformation_graph_data<S, D>&, const node_motions<D>&,                              \
      const point_vector<double, D>&);                                                          \
  extern template node_motions<D> resampled_motions(                                            \
      const deformation_graph_data<S, D>&, const node_motions<D>&, const point_matrix<S, D>&,   \
      const linear_normalizer&);                                                                \
  extern template node_motions<D> composed_motions(                                             \
      const deformation_graph_data<S, D>&, const node_motions<D>&,                              \
      const deformation_graph_data<S, D>&, const node_motions<D>&, const linear_normalizer&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
