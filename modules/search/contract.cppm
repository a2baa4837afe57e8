// SPDX-License-Identifier: MIT
export module cilantro.search:contract;

import cilantro.standard;
import cilantro.core;
import :brute_force;
import :kd_tree;
import :kd_tree_nodes;
import :metric;
import :neighbor_searcher;
import :neighborhood;
import :visit;

namespace cilantro {

/// Options of the `check_…` functions, which test types of yours.
export struct contract_options {
  index_t queries = 100;   ///< How many random cases are tried.
  std::uint64_t seed = 0;  ///< Determines the cases.
};

/// Whether two distances are equal up to rounding.
template <Scalar S>
[[nodiscard]] bool is_close(S a, S b) {
  return std::abs(a - b) <= 64 * std::numeric_limits<S>::epsilon() * std::max(a, b);
}

/// Compares a searcher with brute force, one query and specification at a time, and collects the
/// differences. Distances may differ by rounding, since a searcher may sum in another order.
template <NeighborSearcher T, Metric<typename T::scalar, T::static_dimension> M>
class searcher_contract {
 public:
  using scalar = typename T::scalar;
  using view_type = points_view<scalar, T::static_dimension>;
  using query_type = point_vector<scalar, T::static_dimension>;

  searcher_contract(const T& searcher, view_type points, const M& metric)
      : searcher_{searcher}, points_{points}, by_{metric}, truth_{points, metric} {}

  void check(const query_type& query, neighborhood_spec spec, const std::string& what) {
    // What `found` holds beforehand must not affect the result.
    std::vector<neighbor<scalar>> found(3, {-1, -1}), again, expected;
    searcher_.find(query, spec, found);
    searcher_.find(query, spec, again);
    truth_.find(query, spec, expected);
    const auto expect = [&](bool condition, const char* rule) {
      if (!condition && std::ranges::find(broken_, rule) == broken_.end()) {
        violations_.push_back(what + ": " + rule);
        broken_.emplace_back(rule);
      }
      return condition;
    };

    expect(found == again, "two searches with the same arguments give different results");
    if (!expect(std::ranges::all_of(
                    found, [&](const auto& n) { return 0 <= n.index && n.index < points_.size(); }),
                "an index is out of range"))
      return;
    expect(std::ranges::all_of(found,
                               [&](const auto& n) {
                                 return is_close(n.distance, by_.distance(sum_to(query, n.index)));
                               }),
           "a distance is not the distance to its point");
    expect(std::ranges::adjacent_find(found,
                                      [&](const auto& a, const auto& b) {
                                        return b.distance < a.distance ||
                                               (b.distance == a.distance && b.index <= a.index &&
                                                sum_to(query, a.index) == sum_to(query, b.index));
                                      }) == found.end(),
           "neighbors are not in ascending order of distance, then index, or one occurs twice");
    const auto common = std::min(found.size(), expected.size());
    bool nearest = true;
    for (std::size_t i = 0; i < common; ++i)
      nearest = nearest && is_close(found[i].distance, expected[i].distance);
    expect(nearest, "the neighbors are not the nearest points");
    // If one list is longer, its last points must lie at the limit, where rounding decides.
    const auto& longer = found.size() > expected.size() ? found : expected;
    expect(std::all_of(longer.begin() + std::ptrdiff_t(common), longer.end(),
                       [&](const auto& n) {
                         return n.distance > 0 &&
                                is_close(n.distance, static_cast<scalar>(spec.max_distance()));
                       }),
           found.size() > expected.size() ? "there are too many neighbors"
                                          : "there are too few neighbors");
  }

  [[nodiscard]] std::vector<std::string>& violations() { return violations_; }
  [[nodiscard]] const brute_force_searcher<scalar, T::static_dimension, M>& truth() const {
    return truth_;
  }

 private:
  [[nodiscard]] scalar sum_to(const query_type& query, index_t i) const {
    return by_.between(query.data(), points_.data() + i * points_.stride(), points_.dimension());
  }

  const T& searcher_;
  view_type points_;
  ordering<scalar, T::static_dimension, M> by_;
  brute_force_searcher<scalar, T::static_dimension, M> truth_;
  std::vector<std::string> violations_, broken_;  ///< Each broken rule is listed once.
};

/// Compares the answers of a searcher to many queries at once, by `find_all` and `visit_all` if it
/// has them, with those of `find` to each query. Enough queries to fill several blocks.
template <NeighborSearcher T>
class batch_contract {
 public:
  using scalar = typename T::scalar;
  using view_type = points_view<scalar, T::static_dimension>;

  /// The queries are the first points, repeated.
  batch_contract(const T& searcher, view_type points)
      : searcher_{searcher}, queries_(points.dimension(), query_count) {
    for (index_t q = 0; q < query_count; ++q)
      queries_.col(q) = points[q % std::min<index_t>(points.size(), different_queries)];
  }

  void check(const neighborhood_spec& spec) {
    expected_.resize(query_count);
    for (index_t q = 0; q < query_count; ++q)
      if (q < different_queries)
        searcher_.find(query_type{queries_.col(q)}, spec, expected_[std::size_t(q)]);
      else
        expected_[std::size_t(q)] = expected_[std::size_t(q - different_queries)];
    if constexpr (BatchSearcher<T>) check_all(spec);
    if constexpr (VisitingSearcher<T>)
      for (const bool ascending : {true, false})
        for (const bool all : {true, false}) check_visits(spec, ascending, all);
  }
  [[nodiscard]] std::vector<std::string> take() { return violations_.take(); }

 private:
  using query_type = point_vector<scalar, T::static_dimension>;
  static constexpr index_t different_queries = 60, query_count = 20 * different_queries;

  void check_all(const neighborhood_spec& spec) {
    const auto all = searcher_.find_all(view_type{points_in(queries_)}, spec, execution{});
    violations_.expect(all.size() == query_count,
                       "find_all does not return one neighborhood per query");
    for (index_t q = 0; q < query_count && all.size() == query_count; ++q)
      violations_.expect(are_same(all[q], expected_[std::size_t(q)]),
                         "find_all and find give different results");
  }
  void check_visits(const neighborhood_spec& spec, bool ascending, bool all) {
    std::vector<std::uint8_t> wanted(query_count, 1);
    for (std::size_t q = 0; q < wanted.size() && !all; ++q) wanted[q] = q % 3 != 1;
    std::vector<std::vector<neighbor<scalar>>> visited(query_count);
    std::vector<int> visits(query_count, 0);
    std::mutex one_at_a_time;
    searcher_.visit_all(
        view_type{points_in(queries_)}, spec,
        [&](const neighborhood_block<scalar>& block) {
          const std::scoped_lock lock{one_at_a_time};
          for (index_t i = 0; i < block.size(); ++i) {
            const index_t q = block.query(i);
            violations_.expect(0 <= q && q < query_count,
                               "visit_all visits a query that was not given");
            if (q < 0 || q >= query_count) continue;
            ++visits[std::size_t(q)];
            for (const neighbor<scalar> one : block[i]) visited[std::size_t(q)].push_back(one);
          }
        },
        {.wanted = all ? std::span<const std::uint8_t>{} : wanted, .ascending = ascending});
    for (std::size_t q = 0; q < wanted.size(); ++q) {
      violations_.expect(wanted[q] || visits[q] == 0,
                         "visit_all visits a query that is not wanted");
      violations_.expect(
          !wanted[q] || visits[q] == 1 || (visits[q] == 0 && !is_finite(queries_.col(index_t(q)))),
          "visit_all does not visit each wanted query exactly once");
      if (visits[q] != 1) continue;
      auto truth = expected_[q];
      if (!ascending) {
        std::ranges::sort(truth, {}, [](const auto& one) { return one.index; });
        std::ranges::sort(visited[q], {}, [](const auto& one) { return one.index; });
      }
      violations_.expect(are_same(visited[q], truth), "visit_all and find give different results");
    }
  }
  /// Equal up to rounding, which may swap neighbours at the same distance.
  static bool are_same(const auto& a, const std::vector<neighbor<scalar>>& b) {
    if (std::ssize(a) != std::ssize(b)) return false;
    for (index_t i = 0; i < std::ssize(b); ++i)
      if (!is_close(neighbor<scalar>(a[std::size_t(i)]).distance, b[std::size_t(i)].distance))
        return false;
    return true;
  }

  const T& searcher_;
  point_matrix<scalar, T::static_dimension> queries_;
  std::vector<std::vector<neighbor<scalar>>> expected_;
  violation_list violations_;
};

/// Tests a searcher of yours, built from `points`, against the semantics of `NeighborSearcher`:
/// counts, order, radii, repeated searches, queries that are not finite, k beyond N; and many
/// queries at once, if it is a `VisitingSearcher` or a `BatchSearcher`. The results expected are
/// those of brute force with `metric`. Returns a sentence for each rule that is broken; if there is
/// none, the searcher can be used wherever a `kd_tree` can. To test duplicates and non-finite
/// points, include some in `points`. O(queries · N).
export template <NeighborSearcher T, PointsSource P,
                 Metric<typename T::scalar, T::static_dimension> M = euclidean>
[[nodiscard]] std::vector<std::string> check_neighbor_searcher(const T& searcher, const P& points,
                                                               const contract_options& options = {},
                                                               const M& metric = {}) {
  using S = typename T::scalar;
  using contract = searcher_contract<T, M>;
  const typename contract::view_type view = points_in(points);
  contract test{searcher, view, metric};
  auto& violations = test.violations();
  if (index_t(searcher.size()) != view.size())
    violations.emplace_back("size() is not the number of points");
  if (!view.empty() && index_t(searcher.dimension()) != view.dimension())
    violations.emplace_back("dimension() is not the dimension of the points");
  if (!violations.empty()) return std::move(violations);

  if constexpr (BatchSearcher<T> || VisitingSearcher<T>)
    if (!view.empty()) {
      batch_contract batches{searcher, view};
      for (const neighborhood_spec spec :
           {neighborhood_spec{knn{5}}, neighborhood_spec{radius{0}},
            neighborhood_spec{knn{std::min<index_t>(view.size(), 17) + 3}}})
        batches.check(spec);
      for (auto& sentence : batches.take()) violations.push_back(std::move(sentence));
    }

  std::vector<neighbor<S>> around;
  for (index_t q = 0; q < options.queries && !view.empty(); ++q) {
    random_stream random{options.seed, static_cast<std::uint64_t>(q)};
    const auto name = "query " + std::to_string(q);
    // Half of the queries are points themselves, half lie between two of them.
    typename contract::query_type query = view[random.below(view.size())];
    if (q % 2 == 1) query = (query + view[random.below(view.size())]) / S(2);
    const index_t k = 1 + random.below(std::min<index_t>(view.size(), 20));
    test.truth().find(query, knn{k}, around);
    const double distance = around.empty() ? 1 : double(around.back().distance);

    test.check(query, knn{k}, name + ", knn{" + std::to_string(k) + "}");
    test.check(query, knn{view.size() + 3}, name + ", knn{N + 3}");
    test.check(query, radius{0}, name + ", radius{0}");
    test.check(query, radius{distance}, name + ", radius{" + std::to_string(distance) + "}");
    test.check(query, knn_in_radius{(k + 1) / 2, distance}, name + ", knn_in_radius");
    if (view.dimension() > 0) {
      query[random.below(view.dimension())] = std::numeric_limits<S>::quiet_NaN();
      test.check(query, knn{k}, name + " with NaN, knn{" + std::to_string(k) + "}");
    }
  }
  return std::move(violations);
}

/// Tests a metric of yours on `points` of the kind that it is meant for: that distances are not
/// negative, symmetric, and 0 between equal points; that `sum` is the inverse of `distance` and
/// both are monotone; and that a tree finds the same neighbours as brute force. Returns a sentence
/// for each rule that is broken. O(queries · N).
export template <PointsSource P, CoordinateMetric<scalar_of<P>> M>
[[nodiscard]] std::vector<std::string> check_metric(const M& metric, const P& points,
                                                    const contract_options& options = {}) {
  using S = scalar_of<P>;
  constexpr int D = dimension_of<P>;
  const auto view = points_in(points);
  violation_list violations;
  const ordering<S, D, M> by{metric};
  const auto between = [&](index_t i, index_t j) {
    return by.between(view.data() + i * view.stride(), view.data() + j * view.stride(),
                      view.dimension());
  };
  for (index_t q = 0; q < options.queries && !view.empty(); ++q) {
    random_stream random{options.seed, static_cast<std::uint64_t>(q)};
    const index_t i = random.below(view.size()), j = random.below(view.size());
    if (!is_finite(view[i]) || !is_finite(view[j])) continue;
    const S sum = between(i, j), other = between(j, random.below(view.size()));
    violations.expect(sum >= 0, "a sum is negative or NaN");
    violations.expect(between(i, i) == 0, "a point is not at distance 0 from itself");
    violations.expect(sum == between(j, i), "the distance from a to b is not that from b to a");
    if (other >= 0 && sum >= 0)
      violations.expect((metric.distance(sum) <= metric.distance(other)) == (sum <= other) ||
                            metric.distance(sum) == metric.distance(other),
                        "`distance` does not grow with the sum");
    const S back = metric.distance(metric.sum(metric.distance(sum)));
    violations.expect(std::abs(back - metric.distance(sum)) <=
                          1024 * std::numeric_limits<S>::epsilon() * std::max(S(1), back),
                      "`sum` is not the inverse of `distance`");
  }
  if (!violations.empty()) return violations.take();
  return check_neighbor_searcher(kd_tree<S, D, M>{points, metric, {.max_leaf_size = 2}}, points,
                                 options, metric);
}

}  // namespace cilantro
