// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
export module cilantro.warp:deformation_graph;

import cilantro.standard;
import cilantro.core;
import cilantro.search;

namespace cilantro {

/// Where the nodes of a deformation graph are: points of any kind. `nodes_at{source}` makes every
/// point of the source a node.
export template <Scalar S, int D>
struct nodes_at {
  points_view<S, D> points;  ///< One node each; those that are not finite make no node.

  template <BorrowedPoints P>
  explicit nodes_at(P&& where) : points{as_points(where)} {}
};
export template <BorrowedPoints P>
nodes_at(P&&) -> nodes_at<scalar_of<P>, dimension_of<P>>;

/// Options of a `deformation_graph`.
export struct deformation_graph_options {
  /// The distance between nodes, in the units of the points: the mean of the points in each cell
  /// with this edge is a node. Required, unless the nodes are given.
  double spacing = 0;
  index_t anchors = 4;  ///< How many nodes move a point; from 1 to 16.
  /// The nodes whose motions should agree with that of a node. What a step costs grows with their
  /// number: a radius should be a few spacings.
  neighborhood_spec links = knn{8};
  int threads = 0;
};

inline constexpr std::size_t most_anchors = 16;

/// What a graph consists of. Internal, and in the dimension that the library is compiled for.
template <Scalar S, int D>
struct deformation_graph_data {
  point_matrix<S, D> points;
  point_matrix<S, D> nodes;
  /// Each pair once, the smaller node first, ascending.
  std::vector<std::pair<std::int32_t, std::int32_t>> links;
  index_t anchors_per_point = 0;
  double reach = std::numeric_limits<double>::infinity();  ///< How far a node moves points.
  /// The points that have anchors; those with the same ones lie next to each other, and make a
  /// group.
  std::vector<std::int32_t> order;
  /// Where each group begins in `order`, and where the last one ends.
  std::vector<index_t> groups{0};
  /// For each group `anchors_per_point` nodes, ascending; −1 where there are fewer.
  std::vector<std::int32_t> anchors;
  /// As many weights for each point, in the order of `order`.
  std::vector<double> weights;
  /// The group of each point, and its place in `order`; −1 without anchors.
  std::vector<std::int32_t> group_of, place_of;

  [[nodiscard]] index_t group_count() const { return std::ssize(groups) - 1; }
  /// The nodes of a group.
  [[nodiscard]] std::span<const std::int32_t> anchors_of(index_t group) const {
    const std::int32_t* const first = anchors.data() + group * anchors_per_point;
    std::size_t count = 0;
    while (std::cmp_less(count, anchors_per_point) && first[count] >= 0) ++count;
    return {first, count};
  }
  /// The points of a group.
  [[nodiscard]] std::span<const std::int32_t> points_of(index_t group) const {
    return {order.data() + groups[group], order.data() + groups[group + 1]};
  }
  /// The weights of the point at a place in `order`; there are as many as nodes of its group.
  [[nodiscard]] const double* weights_at(index_t place) const {
    return weights.data() + place * anchors_per_point;
  }
  std::optional<kd_tree<S, D>> tree;  ///< Of the nodes, if there are any.
};

/// The nodes that move one point, ascending, and their weights.
struct point_anchors {
  std::size_t count = 0;
  std::array<std::int32_t, most_anchors> all_nodes;
  std::array<double, most_anchors> all_weights;

  [[nodiscard]] std::span<const std::int32_t> nodes() const { return {all_nodes.data(), count}; }
  [[nodiscard]] std::span<const double> weights() const { return {all_weights.data(), count}; }
};

template <Scalar S, int D>
[[nodiscard]] std::shared_ptr<const deformation_graph_data<S, D>> make_deformation_graph(
    points_view<S, D> points, const points_view<S, D>* nodes, const neighborhoods<S>* connections,
    const deformation_graph_options& options);

/// The nodes nearest to a place. Those of a graph along connections are the nearest in space, too.
template <Scalar S, int D>
[[nodiscard]] point_anchors anchors_at(const deformation_graph_data<S, D>& graph,
                                       const point_vector<S, D>& place);

/// The nodes by which points move, which of them move which point and how much, and which nodes
/// are linked. A value: copies share their contents, which never change.
///
/// A point is moved by the nodes nearest to it, its anchors. With the distance d to an anchor and
/// the distance d₀ to the first node that is none, the weight of an anchor is (1 − d / d₀)²,
/// divided by the sum of the weights; d₀ is at most 2 √Dim times the spacing, so that parts that
/// are farther apart do not move each other, and where all nodes are anchors twice the distance to
/// the farthest. A point that is farther than that from all nodes is moved by the nearest alone.
/// Linked nodes should agree on where each of them is. Source: Sumner, Schmid & Pauly 2007,
/// "Embedded deformation for shape manipulation", section 3.
export template <Scalar S, int D>
class deformation_graph {
 public:
  using scalar = S;
  static constexpr int static_dimension = D;

  /// A graph of no points.
  deformation_graph() = default;
  /// Nodes by `options.spacing`. Keeps a copy of the points; those that are not finite have no
  /// anchors. Throws `invalid_input` for options that make no sense, and for points with an origin
  /// other than zero. O(N log N).
  template <PointsSource P>
  deformation_graph(const P& points, const deformation_graph_options& options)
      : data_{make_deformation_graph<S, C>(view_of(points), nullptr, nullptr, options)} {}
  /// Nodes that are given. Throws `invalid_input` as above, and if `options.spacing` is given, too.
  template <PointsSource P>
  deformation_graph(const P& points, const nodes_at<S, D>& nodes,
                    const deformation_graph_options& options = {}) {
    const points_view<S, C> where{nodes.points};
    data_ = make_deformation_graph<S, C>(view_of(points), &where, nullptr, options);
  }
  /// Nodes by `options.spacing`; distances to them are lengths of paths along `connections`, which
  /// are those of each point with others, such as edges of a mesh or a `neighbor_graph`. So parts
  /// that touch, but are not connected, do not move each other. Nodes are points that are at least
  /// `spacing` apart, and are linked if they move a point together; `options.links` says nothing
  /// then. Connections of points that are not finite do not count. Any point that the graph was not
  /// made of has the anchors nearest in space. Throws `invalid_input` as above, unless there is one
  /// neighbourhood for each point, and for a distance that is negative or NaN.
  template <PointsSource P>
  deformation_graph(const P& points, const neighborhoods<S>& connections,
                    const deformation_graph_options& options)
      : data_{make_deformation_graph<S, C>(view_of(points), nullptr, &connections, options)} {}

  /// The number of points that the graph moves.
  [[nodiscard]] index_t size() const { return index_t(data_->points.cols()); }
  [[nodiscard]] index_t dimension() const { return index_t(data_->points.rows()); }
  /// A copy of the points that the graph was made of.
  [[nodiscard]] points_view<S, D> points() const [[clang::lifetimebound]] {
    return view_in_dimension(data_->points);
  }
  /// The nodes.
  [[nodiscard]] points_view<S, D> nodes() const [[clang::lifetimebound]] {
    return view_in_dimension(data_->nodes);
  }
  /// The pairs of nodes that are linked, each once, the smaller index first.
  [[nodiscard]] std::span<const std::pair<std::int32_t, std::int32_t>> links() const
      [[clang::lifetimebound]] {
    return data_->links;
  }
  /// The nodes that move point i, ascending, and their weights, which add up to 1; none for a point
  /// that is not finite, or from which no path leads to a node. Precondition: 0 <= i < size().
  [[nodiscard]] std::span<const std::int32_t> anchors(index_t i) const [[clang::lifetimebound]] {
    if (data_->group_of[i] < 0) return {};
    return data_->anchors_of(data_->group_of[i]);
  }
  [[nodiscard]] std::span<const double> weights(index_t i) const [[clang::lifetimebound]] {
    if (data_->group_of[i] < 0) return {};
    return {data_->weights_at(data_->place_of[i]), anchors(i).size()};
  }
  /// Whether the graph was made of exactly these points.
  template <PointsSource P>
    requires std::same_as<points_view_of<P>, points_view<S, D>>
  [[nodiscard]] bool is_of(const P& other) const {
    const auto view = points_in(other);
    if (view.size() != size() || (view.size() > 0 && view.dimension() != dimension())) return false;
    const auto mine = points();
    for (index_t i = 0; i < view.size(); ++i)
      for (index_t d = 0; d < view.dimension(); ++d)
        if (!(view[i][d] == mine[i][d] || (view[i][d] != view[i][d] && mine[i][d] != mine[i][d])))
          return false;
    return true;
  }

  /// Two graphs are equal if one is a copy of the other.
  friend bool operator==(const deformation_graph& a, const deformation_graph& b) {
    return a.data_ == b.data_;
  }
  /// For the library.
  explicit deformation_graph(
      std::shared_ptr<const deformation_graph_data<S, closed_dimension<D>>> data)
      : data_{std::move(data)} {}
  [[nodiscard]] const auto& data() const [[clang::lifetimebound]] { return *data_; }
  [[nodiscard]] const auto& shared_data() const [[clang::lifetimebound]] { return data_; }

 private:
  static constexpr int C = closed_dimension<D>;

  static points_view<S, D> view_in_dimension(const point_matrix<S, C>& points) {
    if constexpr (C == D)
      return as_points(points);
    else
      return {points.data(), points.cols()};
  }
  template <class P>
  static points_view<S, C> view_of(const P& points) {
    static_assert(std::same_as<scalar_of<P>, S> && dimension_of<P> == D);
    expect_local(points, "deformation_graph");
    return points_view<S, C>{points_in(points)};
  }
  std::shared_ptr<const deformation_graph_data<S, C>> data_ =
      std::make_shared<const deformation_graph_data<S, C>>();
};
export template <PointsSource P>
deformation_graph(const P&, const deformation_graph_options&)
    -> deformation_graph<scalar_of<P>, dimension_of<P>>;
export template <PointsSource P, Scalar S, int D>
deformation_graph(const P&, const nodes_at<S, D>&, const deformation_graph_options& = {})
    -> deformation_graph<S, D>;
export template <PointsSource P, Scalar S>
deformation_graph(const P&, const neighborhoods<S>&, const deformation_graph_options&)
    -> deformation_graph<S, dimension_of<P>>;

#define CILANTRO_COMPILED_ELSEWHERE(S, D)                                                     \
  extern template std::shared_ptr<const deformation_graph_data<S, D>> make_deformation_graph( \
      points_view<S, D>, const points_view<S, D>*, const neighborhoods<S>*,                   \
      const deformation_graph_options&);                                                      \
  extern template point_anchors anchors_at(const deformation_graph_data<S, D>&,               \
                                           const point_vector<S, D>&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
