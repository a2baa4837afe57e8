// SPDX-License-Identifier: MIT
export module cilantro.search:brute_force;

import cilantro.standard;
import cilantro.core;
import :metric;
import :neighbor_searcher;
import :neighborhood;
import :product_search;
import :visit;

namespace cilantro {

/// Compares every query with every point: the reference that other searchers are tested against,
/// and the fastest way for a few dozen points, and for points of many dimensions, such as features,
/// of which a tree has to look at nearly all. O(N) per query. Views its points, which must outlive
/// it.
///
/// Many queries at once, as by `find_neighborhoods`, are compared by products of matrices if the
/// metric is Euclidean and there are 8 dimensions or more; what is found is the same, to the bit.
///
/// Works with any `Metric`: `brute_force_searcher{points, [](const auto& a, const auto& b) { … }}`.
export template <Scalar S, int D, Metric<S, D> M = euclidean>
class brute_force_searcher {
 public:
  using scalar = S;
  static constexpr int static_dimension = D;

  /// Throws `invalid_input` if the metric is for points of another dimension.
  explicit brute_force_searcher(points_view<S, D> points, const M& metric = {})
      : points_{points}, metric_{metric} {
    if (!points.empty()) expect_dimension<M>(points.dimension());
  }
  template <BorrowedPoints P>
  explicit brute_force_searcher(P&& points, const M& metric = {})
      : brute_force_searcher{as_points(points), metric} {}

  [[nodiscard]] index_t size() const { return points_.size(); }
  [[nodiscard]] index_t dimension() const { return points_.dimension(); }

  /// As `NeighborSearcher` says. Throws `invalid_input` if the dimensions differ.
  void find(const point_ref<S, D>& query, neighborhood_spec spec,
            std::vector<neighbor<S>>& out) const {
    out.clear();
    if (points_.empty()) return;
    expects(query.size() == dimension(), "find: query and points must have the same dimension");
    const S largest = largest_searchable_coordinate<S>(dimension());
    if (!is_searchable(query.data(), dimension(), largest)) return;
    const ordering<S, D, M> by{metric_};
    const S limit = by.limit(spec.max_distance());
    for (index_t i = 0; i < size(); ++i) {
      const S* point = points_.data() + i * points_.stride();
      if (!is_searchable(point, dimension(), largest)) continue;
      const S sum = by.between(query.data(), point, dimension());
      if (sum <= limit) out.push_back({i, sum});
    }
    const auto count = std::min(spec.max_count(), std::ssize(out));
    std::ranges::partial_sort(out, out.begin() + count, {},
                              [](const neighbor<S>& n) { return std::pair{n.distance, n.index}; });
    out.resize(count);
    for (auto& n : out) n.distance = by.distance(n.distance);
  }

  /// Use `visit_neighborhoods` instead: it checks the arguments, and then calls this.
  void visit_all(points_view<S, D> queries, neighborhood_spec spec,
                 const neighborhood_visitor<S>& visit, const visit_options& options) const {
    if constexpr (std::same_as<M, euclidean>)
      if (dimension() >= least_product_dimension)
        return visit_by_products<S>(points_, queries, spec, visit, options);
    visit_queries<S>(queries.size(), visit, options, [&] {
      return [&](index_t q, auto& found) { find(queries[q], spec, found); };
    });
  }

 private:
  points_view<S, D> points_;
  M metric_;
};
export template <PointsSource P>
brute_force_searcher(P&&) -> brute_force_searcher<scalar_of<P>, dimension_of<P>>;
export template <PointsSource P, Metric<scalar_of<P>, dimension_of<P>> M>
brute_force_searcher(P&&, M) -> brute_force_searcher<scalar_of<P>, dimension_of<P>, M>;

static_assert(NeighborSearcher<brute_force_searcher<float, 3>>);
static_assert(NeighborSearcher<brute_force_searcher<double, dynamic>>);

}  // namespace cilantro
