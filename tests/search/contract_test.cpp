// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

/// A searcher with a fault that can be chosen.
struct faulty {
  using scalar = float;
  static constexpr int static_dimension = 3;
  enum class fault { none, keeps_old, squared, exclusive, misses_last, unsorted, ignores_k };

  brute_force_searcher<float, 3> inner;
  fault f = fault::none;

  [[nodiscard]] index_t size() const { return inner.size(); }
  [[nodiscard]] index_t dimension() const { return 3; }
  void find(const Eigen::Vector3f& query, neighborhood_spec spec,
            std::vector<neighbor<float>>& out) const {
    const auto before = out;
    inner.find(query, f == fault::ignores_k ? radius{spec.max_distance()} : spec, out);
    if (f == fault::keeps_old) out.insert(out.end(), before.begin(), before.end());
    if (f == fault::squared)
      for (auto& n : out) n.distance *= n.distance;
    if (f == fault::exclusive)
      std::erase_if(out, [&](const auto& n) { return n.distance >= float(spec.max_distance()); });
    if (f == fault::misses_last && out.size() > 1) out.erase(out.begin());
    if (f == fault::unsorted) std::ranges::reverse(out);
  }
};

/// Not even the member `find`.
struct without_find {
  using scalar = float;
  static constexpr int static_dimension = 3;
  [[nodiscard]] index_t size() const { return 0; }
  [[nodiscard]] index_t dimension() const { return 3; }
};

/// In one text, so that a failure shows them.
std::string violations(const std::vector<std::string>& all) {
  std::string text;
  for (const auto& v : all) text += v + '\n';
  return text;
}

/// Answers many queries at once, in one of many ways that are wrong.
struct visiting {
  enum class fault { none, twice, unwanted, forgets, descending, lets_out, none_of_these };
  using scalar = float;
  static constexpr int static_dimension = 3;

  brute_force_searcher<float, 3> truth;
  fault how = fault::none;

  [[nodiscard]] index_t size() const { return truth.size(); }
  [[nodiscard]] index_t dimension() const { return truth.dimension(); }
  void find(const Eigen::Vector3f& query, neighborhood_spec spec,
            std::vector<neighbor<float>>& out) const {
    truth.find(query, spec, out);
  }
  void visit_all(points_view<float, 3> queries, neighborhood_spec spec,
                 const neighborhood_visitor<float>& visit, const visit_options& options) const {
    found_block<float> block;
    std::vector<neighbor<float>> found;
    for (index_t q = queries.size() - 1; q >= 0; --q) {
      if (!options.wanted.empty() && options.wanted[std::size_t(q)] == 0 && how != fault::unwanted)
        continue;
      if (how == fault::lets_out && q == 3) continue;
      truth.find(queries[q], spec, found);
      if (how == fault::forgets && !found.empty()) found.pop_back();
      if (how == fault::descending) std::ranges::reverse(found);
      block.add(q, found);
      if (how == fault::twice) block.add(q, found);
    }
    if (how == fault::none_of_these) block.add(queries.size(), found);
    visit(block.view());
  }
};
static_assert(VisitingSearcher<visiting> && !BatchSearcher<visiting>);
static_assert(VisitingSearcher<kd_tree<double, dynamic>> &&
              BatchSearcher<kd_tree<double, dynamic>>);
static_assert(!VisitingSearcher<faulty>);

}  // namespace

static_assert(NeighborSearcher<faulty>);
static_assert(!NeighborSearcher<without_find>);
static_assert(!NeighborSearcher<int>);
static_assert(CoordinateMetric<euclidean> && !CoordinateMetric<int>);

TEST_CASE_TEMPLATE("the shipped searchers keep the contract", T, ALL_SPACES) {
  auto points = test::random_points<T>(300);
  points.rightCols(50) = points.leftCols(50).eval();
  points(0, 7) = test::nan<typename T::scalar>;
  const kd_tree tree{points};
  CHECK(violations(check_neighbor_searcher(tree, points)) == "");
  const brute_force_searcher brute{points};
  CHECK(violations(check_neighbor_searcher(brute, points)) == "");
}

TEST_CASE("the contract holds for no points and for one") {
  for (const index_t n : {0, 1}) {
    const auto points = test::random_points<test::d2>(n);
    CHECK(violations(check_neighbor_searcher(kd_tree{points}, points)) == "");
  }
}

TEST_CASE("every broken rule of the contract is noticed and named") {
  auto points = test::random_points<test::f3>(200, 3);
  const auto violations_of = [&](faulty::fault f) {
    const faulty searcher{brute_force_searcher{points}, f};
    return violations(check_neighbor_searcher(searcher, points));
  };
  const auto names = [&](faulty::fault f, const char* what) {
    return violations_of(f).find(what) != std::string::npos;
  };
  using fault = faulty::fault;
  CHECK(violations_of(fault::none) == "");
  CHECK(names(fault::keeps_old, "two searches with the same arguments give different results"));
  CHECK(names(fault::squared, "a distance is not the distance to its point"));
  CHECK(names(fault::exclusive, "radius{0}: there are too few neighbors"));
  CHECK(names(fault::misses_last, "the neighbors are not the nearest points"));
  CHECK(names(fault::misses_last, "there are too few neighbors"));
  CHECK(names(fault::unsorted, "not in ascending order"));
  CHECK(names(fault::ignores_k, "there are too many neighbors"));
  const auto fewer = points.leftCols(10).eval();
  CHECK(check_neighbor_searcher(faulty{brute_force_searcher{fewer}}, points) ==
        std::vector<std::string>{"size() is not the number of points"});
}

TEST_CASE("every broken rule of answering many queries at once is noticed and named") {
  auto points = test::random_points<test::f3>(200, 3);
  points(1, 8) = test::nan<float>;
  const auto names = [&](visiting::fault how, const char* what) {
    const visiting searcher{brute_force_searcher{points}, how};
    return violations(check_neighbor_searcher(searcher, points)).find(what) != std::string::npos;
  };
  using enum visiting::fault;
  CHECK(violations(check_neighbor_searcher(visiting{brute_force_searcher{points}}, points)) == "");
  CHECK(names(twice, "visit_all does not visit each wanted query exactly once"));
  CHECK(names(lets_out, "visit_all does not visit each wanted query exactly once"));
  CHECK(names(unwanted, "visit_all visits a query that is not wanted"));
  CHECK(names(forgets, "visit_all and find give different results"));
  CHECK(names(descending, "visit_all and find give different results"));
  CHECK(names(none_of_these, "visit_all visits a query that was not given"));
  for (const auto how : {twice, none_of_these}) {
    const visiting searcher{brute_force_searcher{points}, how};
    CHECK_THROWS_AS((void)find_neighborhoods(searcher, points, knn{3}), invalid_input);
  }
}

TEST_CASE("what a searcher visits in an order of its own is kept in the order of the queries") {
  const auto points = test::random_points<test::f3>(700, 3);
  const visiting searcher{brute_force_searcher{points}};
  const auto found = find_neighborhoods(searcher, points, radius{0.3});
  const auto expected = find_neighborhoods(kd_tree{points}, points, radius{0.3});
  CHECK(std::ranges::equal(found.offsets(), expected.offsets()));
  CHECK(std::ranges::equal(found.indices(), expected.indices()));
}
