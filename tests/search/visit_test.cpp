// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <stop_token>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

/// Neighbours by query; −1 where nobody came.
template <class S>
struct visited {
  std::vector<std::vector<neighbor<S>>> found;
  std::vector<int> visits;
};

template <class T, class Q>
auto visit_all_of(const T& searcher, const Q& queries, neighborhood_spec spec,
                  const visit_options& options = {}) {
  using S = typename T::scalar;
  const auto n = static_cast<std::size_t>(queries.cols());
  visited<S> all{std::vector<std::vector<neighbor<S>>>(n), std::vector<int>(n)};
  visit_neighborhoods(
      searcher, as_points(queries), spec,
      [&](const neighborhood_block<S>& block) {
        // Each query belongs to one block.
        for (index_t i = 0; i < block.size(); ++i) {
          const auto q = static_cast<std::size_t>(block.query(i));
          ++all.visits[q];
          all.found[q].assign(block[i].begin(), block[i].end());
        }
      },
      options);
  return all;
}

/// A searcher with `find` and nothing else.
template <class S>
struct plain_searcher {
  using scalar = S;
  static constexpr int static_dimension = 3;
  const kd_tree<S, 3>& tree;
  [[nodiscard]] index_t size() const { return tree.size(); }
  [[nodiscard]] index_t dimension() const { return tree.dimension(); }
  void find(const Eigen::Ref<const point_vector<S, 3>>& query, neighborhood_spec spec,
            std::vector<neighbor<S>>& out) const {
    tree.find(query, spec, out);
  }
};

}  // namespace

TEST_CASE_TEMPLATE("visiting hands on what find finds, each query once", T, ALL_SPACES) {
  using S = typename T::scalar;
  auto points = test::random_points<T>(1000, 1);
  points(0, 17) = test::nan<S>;
  const auto others = test::random_points<T>(333, 2);
  const kd_tree tree{points};
  for (const neighborhood_spec spec :
       {neighborhood_spec{knn{7}}, neighborhood_spec{knn{50}}, neighborhood_spec{radius{0.3}},
        neighborhood_spec{knn_in_radius{4, 0.2}}, neighborhood_spec{knn_in_radius{1, 0}}}) {
    const auto check = [&](const auto& queries) {
      const auto all = visit_all_of(tree, queries, spec);
      for (index_t q = 0; q < queries.cols(); ++q) {
        const auto at = static_cast<std::size_t>(q);
        if (is_finite(queries.col(q))) REQUIRE(all.visits[at] == 1);
        REQUIRE(all.found[at] == tree.find(queries.col(q), spec));
      }
    };
    check(points);
    check(others);
  }
}

TEST_CASE_TEMPLATE("a searcher that only finds can be visited, too", S, float, double) {
  const auto points = test::random_points<test::space<S, 3>>(600, 3);
  const kd_tree<S, 3> tree{points};
  const auto all = visit_all_of(plain_searcher<S>{tree}, points, knn{5});
  CHECK(std::ranges::all_of(all.visits, [](int n) { return n == 1; }));
  CHECK(all.found == visit_all_of(tree, points, knn{5}).found);
}

TEST_CASE_TEMPLATE("only wanted queries are asked", T, CLOUD_SPACES) {
  const auto points = test::random_points<T>(900, 4);
  std::vector<std::uint8_t> wanted(900);
  for (std::size_t i = 0; i < wanted.size(); ++i) wanted[i] = i % 3 == 0 && i < 600;
  for (const neighborhood_spec spec : {neighborhood_spec{knn{5}}, neighborhood_spec{radius{0.1}}}) {
    const auto all = visit_all_of(kd_tree{points}, points, spec, {.wanted = wanted});
    for (std::size_t i = 0; i < wanted.size(); ++i) REQUIRE(all.visits[i] == wanted[i]);
  }
}

TEST_CASE_TEMPLATE("in any order the neighbors are the same", T, CLOUD_SPACES) {
  const auto points = test::random_points<T>(900, 5);
  const kd_tree tree{points};
  const auto ordered = visit_all_of(tree, points, radius{0.3});
  auto any = visit_all_of(tree, points, radius{0.3}, {.ascending = false});
  for (auto& near : any.found)
    std::ranges::sort(near, {}, [](const auto& n) { return std::pair{n.distance, n.index}; });
  CHECK(any.found == ordered.found);
}

TEST_CASE("blocks do not depend on the number of threads") {
  const auto points = test::random_points<test::f3>(5000, 6);
  const kd_tree tree{points};
  const auto one = visit_all_of(tree, points, knn{6}, {.threads = 1});
  for (const int threads : {2, 3}) {
    const auto more = visit_all_of(tree, points, knn{6}, {.threads = threads});
    CHECK(more.found == one.found);
  }
}

TEST_CASE_TEMPLATE("large neighborhoods are handed on in parts, each query once", T, ALL_SPACES) {
  const auto points = test::random_points<T>(3000);
  const kd_tree tree{points};
  std::vector<int> visits(3000);
  std::size_t most = 0;
  visit_neighborhoods(tree, as_points(points), radius{1e6},
                      [&](const neighborhood_block<typename T::scalar>& block) {
                        std::size_t kept = 0;
                        for (index_t i = 0; i < block.size(); ++i) {
                          ++visits[static_cast<std::size_t>(block.query(i))];
                          CHECK(block[i].size() == 3000);
                          kept += static_cast<std::size_t>(block[i].size());
                        }
                        most = std::max(most, kept);
                      },
                      {.ascending = false, .threads = 1});
  CHECK(std::ranges::all_of(visits, [](int v) { return v == 1; }));
  CHECK(most <= (std::size_t{1} << 18) + 3000);
}

TEST_CASE("what cannot be visited is refused, and a visit can be stopped") {
  const auto points = test::random_points<test::f3>(5000, 7);
  const kd_tree tree{points};
  const auto nothing = [](const neighborhood_block<float>&) {};
  const std::vector<std::uint8_t> few(3);
  CHECK_THROWS_AS(visit_neighborhoods(tree, as_points(points), knn{3}, nothing, {.wanted = few}),
                  invalid_input);
  const auto flat = test::random_points<test::fx>(5);
  const kd_tree other{flat};
  CHECK_THROWS_AS(
      visit_neighborhoods(other, points_view<float, dynamic>{as_points(points)}, knn{3}, nothing),
      invalid_input);
  std::stop_source stop;
  stop.request_stop();
  CHECK_THROWS_AS(visit_neighborhoods(tree, as_points(points), knn{3}, nothing,
                                      {.monitor = {{}, stop.get_token()}}),
                  cancelled);
  double last = 0;
  visit_neighborhoods(tree, as_points(points), knn{3}, nothing,
                      {.monitor = {[&](double done) { last = std::max(last, done); }, {}}});
  CHECK(last == 1);
}
