// SPDX-License-Identifier: MIT
export module cilantro.search:kd_tree;

import cilantro.standard;
import cilantro.core;
import :concepts;
import :metric;
import :neighborhood;

namespace cilantro {

export struct kd_tree_options {
  int max_leaf_size = 10;  ///< Points in a leaf, at least 1. Affects speed only.
};

/// The tree behind `kd_tree`: compiled once in the library for each scalar and for 2, 3 and
/// run-time dimensions, so that its implementation never reaches an importer.
template <Scalar S, int D, Metric M>
class kd_tree_engine {
 public:
  kd_tree_engine(points_view<S, D> points, kd_tree_options options);
  kd_tree_engine(point_matrix<S, D>&& points, kd_tree_options options);
  kd_tree_engine(const kd_tree_engine&) = delete;
  kd_tree_engine& operator=(const kd_tree_engine&) = delete;
  ~kd_tree_engine();

  [[nodiscard]] points_view<S, D> points() const;
  void find(const S* query, const neighborhood_spec& spec, std::vector<neighbor<S>>& out) const;
  [[nodiscard]] neighborhoods<S> find_all(points_view<S, D> queries, const neighborhood_spec& spec,
                                          const execution& how) const;

 private:
  struct state;
  std::unique_ptr<const state> state_;
};

/// Nearest neighbours in a set of points that does not change.
///
/// Built over an lvalue or a view, it looks at those points, which must stay alive and unchanged
/// for as long as the tree or a copy of it; built from an rvalue matrix, it takes it over. Copies
/// share one immutable tree: copying costs a pointer, and any copy may be used from any thread.
///
/// Points with a non-finite coordinate (or one beyond `largest_searchable_coordinate`) are never
/// found, and such queries find nothing; indices count all points all the same. At most 2³¹ − 1
/// points. Building is O(N log N); a query for k neighbours in low dimension O(k log k + log N).
/// Source: Bentley 1975; Friedman, Bentley & Finkel 1977, as implemented by nanoflann.
export template <Scalar S, int D, Metric M = euclidean>
class kd_tree {
 public:
  using scalar = S;
  static constexpr int static_dimension = D;

  /// Throws `invalid_input` for points without a dimension, too many points, or an empty leaf.
  template <BorrowedPoints P>
    requires std::same_as<scalar_of<P>, S> && (D == dynamic || dimension_of<P> == D)
  explicit kd_tree(P&& points, kd_tree_options options = {})
      : engine_{std::make_shared<const engine>(
            points_view<S, closed_dimension<D>>{as_points(std::forward<P>(points))}, options)} {}

  /// Takes the points over.
  explicit kd_tree(point_matrix<S, D>&& points, kd_tree_options options = {})
      : engine_{std::make_shared<const engine>(
            point_matrix<S, closed_dimension<D>>{std::move(points)}, options)} {}
  /// As above of a constant temporary, which is what `eval()` of Eigen returns: a copy.
  explicit kd_tree(const point_matrix<S, D>&& points, kd_tree_options options = {})
      : kd_tree{point_matrix<S, D>{points}, options} {}

  /// The number of points, those that are never found included.
  [[nodiscard]] index_t size() const { return engine_->points().size(); }
  [[nodiscard]] index_t dimension() const { return engine_->points().dimension(); }

  /// The points that the tree was built from.
  [[nodiscard]] points_view<S, D> points() const {
    const auto view = engine_->points();
    if constexpr (D == dynamic)
      return {view.data(), view.size(), view.dimension(), view.stride()};
    else
      return {view.data(), view.size(), view.stride()};
  }

  /// Writes the neighbours of `query` to `out`, as `NeighborSearcher` says; `out` may be reused to
  /// save its allocation. Throws `invalid_input` if the dimensions differ.
  void find(const Eigen::Ref<const point_vector<S, D>>& query, neighborhood_spec spec,
            std::vector<neighbor<S>>& out) const {
    expects(size() == 0 || query.size() == dimension(),
            "find: query and points must have the same dimension");
    engine_->find(query.data(), spec, out);
  }
  [[nodiscard]] std::vector<neighbor<S>> find(const Eigen::Ref<const point_vector<S, D>>& query,
                                              neighborhood_spec spec) const {
    std::vector<neighbor<S>> out;
    find(query, spec, out);
    return out;
  }

  /// The nearest point; nothing if there is none. Of several at the same distance, the first.
  [[nodiscard]] std::optional<neighbor<S>> nearest(
      const Eigen::Ref<const point_vector<S, D>>& query) const {
    const auto found = find(query, knn{1});
    return found.empty() ? std::nullopt : std::optional{found.front()};
  }

  /// The neighbourhoods of all `queries`, in parallel and in their order.
  /// Throws `invalid_input` if the dimensions differ.
  [[nodiscard]] neighborhoods<S> find_all(points_view<S, D> queries, neighborhood_spec spec,
                                          const execution& how = {}) const {
    expects(queries.empty() || size() == 0 || queries.dimension() == dimension(),
            "find_all: queries and points must have the same dimension");
    return engine_->find_all(queries, spec, how);
  }

 private:
  using engine = kd_tree_engine<S, closed_dimension<D>, M>;
  std::shared_ptr<const engine> engine_;
};

export template <PointsSource P>
kd_tree(P&&, kd_tree_options = {}) -> kd_tree<scalar_of<P>, dimension_of<P>>;

static_assert(NeighborSearcher<kd_tree<float, 3>> && BatchSearcher<kd_tree<float, 3>>);
static_assert(NeighborSearcher<kd_tree<double, dynamic>>);

}  // namespace cilantro
