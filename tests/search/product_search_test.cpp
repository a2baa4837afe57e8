// SPDX-License-Identifier: MIT
//
// Many queries in many dimensions, by products, find what one query at a time finds.
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

template <class S>
void expect_same(const Eigen::Matrix<S, dynamic, dynamic>& points,
                 const Eigen::Matrix<S, dynamic, dynamic>& queries, neighborhood_spec spec) {
  const brute_force_searcher searcher{points};
  const auto found = find_neighborhoods(searcher, queries, spec);
  std::vector<neighbor<S>> one;
  for (index_t q = 0; q < queries.cols(); ++q) {
    searcher.find(queries.col(q), spec, one);
    REQUIRE(found[q].size() == one.size());
    for (std::size_t k = 0; k < one.size(); ++k) {
      CHECK(found[q].indices()[k] == one[k].index);
      CHECK(found[q].distances()[k] == one[k].distance);
    }
  }
}

}  // namespace

TEST_CASE_TEMPLATE("products find the same neighbours at the same distances", S, float, double) {
  for (const index_t dimension : {8, 33, 100}) {
    const auto make = [&](index_t count, std::uint64_t seed) {
      Eigen::Matrix<S, dynamic, dynamic> all(dimension, count);
      random_stream random{seed};
      for (auto& x : all.reshaped()) x = S(random.uniform(0, 1));
      return all;
    };
    auto points = make(391, 1), queries = make(70, 2);
    // Ties, equal points, and what no search finds.
    points.col(7) = points.col(300) = queries.col(3);
    points(2, 40) = test::nan<S>;
    points(2, 41) = test::infinity<S>;
    queries(0, 5) = test::nan<S>;
    for (const auto target : test::available_targets()) {
      const test::using_target used{target};
      const double middle = std::sqrt(double(dimension) / 6);
      for (const neighborhood_spec spec :
           {neighborhood_spec{knn{1}}, neighborhood_spec{knn{7}}, neighborhood_spec{knn{1000}},
            neighborhood_spec{radius{middle}}, neighborhood_spec{radius{0}},
            neighborhood_spec{knn_in_radius{3, middle}}})
        expect_same<S>(points, queries, spec);
    }
  }
}

TEST_CASE_TEMPLATE("far from the origin, where products round most, the same is found", S, float,
                   double) {
  Eigen::Matrix<S, dynamic, dynamic> points(9, 200), queries(9, 20);
  random_stream random{3};
  for (auto& x : points.reshaped()) x = S(1000 + random.uniform(0, 1));
  for (auto& x : queries.reshaped()) x = S(1000 + random.uniform(0, 1));
  expect_same<S>(points, queries, knn{5});
  expect_same<S>(points, queries, radius{1.0});
}

TEST_CASE("searchers by products keep their contract") {
  const auto points = test::random_points<test::space<float, 12>>(300);
  const auto queries = test::random_points<test::space<float, 12>>(50, 1);
  CHECK(check_neighbor_searcher(brute_force_searcher{points}, points).empty());
  CHECK(find_neighborhoods(brute_force_searcher{points}, queries, knn{3})[49].size() == 3);
  const Eigen::MatrixXf empty(12, 0);
  const brute_force_searcher none{empty};
  CHECK(find_neighborhoods(none, Eigen::MatrixXf::Ones(12, 3).eval(), knn{2})[1].empty());
}
