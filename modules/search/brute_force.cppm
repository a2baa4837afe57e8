// SPDX-License-Identifier: MIT
export module cilantro.search:brute_force;

import cilantro.standard;
import cilantro.core;
import :concepts;
import :metric;
import :neighborhood;

namespace cilantro {

/// Looks at every point for every query: the truth that other searchers are tested against, and the
/// fastest way for a few dozen points. O(N) a query. Views its points, which must outlive it.
export template <Scalar S, int D, Metric M = euclidean>
class brute_force_searcher {
 public:
  using scalar = S;
  static constexpr int static_dimension = D;

  explicit brute_force_searcher(points_view<S, D> points) : points_{points} {}
  template <BorrowedPoints P>
  explicit brute_force_searcher(P&& points) : brute_force_searcher{as_points(points)} {}

  [[nodiscard]] index_t size() const { return points_.size(); }
  [[nodiscard]] index_t dimension() const { return points_.dimension(); }

  /// As `NeighborSearcher` says. Throws `invalid_input` if the dimensions differ.
  void find(const Eigen::Ref<const point_vector<S, D>>& query, neighborhood_spec spec,
            std::vector<neighbor<S>>& out) const {
    out.clear();
    if (points_.empty()) return;
    expects(query.size() == dimension(), "find: query and points must have the same dimension");
    const S largest = largest_searchable_coordinate<S>(dimension());
    if (!is_searchable(query.data(), dimension(), largest)) return;
    const S limit = M::sum(static_cast<S>(spec.max_distance()));
    for (index_t i = 0; i < size(); ++i) {
      const S* point = points_.data() + i * points_.stride();
      if (!is_searchable(point, dimension(), largest)) continue;
      const S sum = metric_sum<M>(query.data(), point, dimension());
      if (sum <= limit) out.push_back({i, sum});
    }
    const auto count = std::min(spec.max_count(), std::ssize(out));
    std::ranges::partial_sort(out, out.begin() + count, {},
                              [](const neighbor<S>& n) { return std::pair{n.distance, n.index}; });
    out.resize(static_cast<std::size_t>(count));
    for (auto& n : out) n.distance = M::distance(n.distance);
  }

 private:
  points_view<S, D> points_;
};
export template <PointsSource P>
brute_force_searcher(P&&) -> brute_force_searcher<scalar_of<P>, dimension_of<P>>;

static_assert(NeighborSearcher<brute_force_searcher<float, 3>>);
static_assert(NeighborSearcher<brute_force_searcher<double, dynamic>>);

}  // namespace cilantro
