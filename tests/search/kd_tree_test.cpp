// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <stop_token>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

template <class T>
using matrix_of = point_matrix<typename T::scalar, T::static_dimension>;
template <class T>
using view_of = points_view<typename T::scalar, T::static_dimension>;

/// Points on the corners of a lattice: most distances occur many times.
template <class T>
matrix_of<T> lattice(index_t count, std::uint64_t seed) {
  auto points = test::random_points<T>(count, seed, 0, 4);
  points = points.array().floor();
  return points;
}

/// Points on one line, twice each, as good as all cuts of a tree are bad.
template <class T>
matrix_of<T> doubled_line(index_t count) {
  matrix_of<T> points(T::dimension, count);
  for (index_t i = 0; i < count; ++i) points.col(i).setConstant(typename T::scalar(i / 2) / 8);
  return points;
}

/// A tenth of the points have NaN or infinity somewhere.
template <class T>
matrix_of<T> with_holes(matrix_of<T> points) {
  for (index_t i = 3; i < points.cols(); i += 10)
    points(i % T::dimension, i) =
        i % 20 == 3 ? test::nan<typename T::scalar> : -test::infinity<typename T::scalar>;
  return points;
}

/// The tree finds what brute force finds, to the bit.
template <class T>
void expect_truth(const matrix_of<T>& points, std::uint64_t seed, index_t queries = 150) {
  using S = typename T::scalar;
  const kd_tree tree{points};
  const brute_force_searcher truth{points};
  const S scale = points.cols() > 0 ? S(1.5) : S(1);
  const auto other = test::random_points<T>(queries, seed, -1.2, 1.2);
  std::vector<neighbor<S>> found, expected;
  for (index_t q = 0; q < queries; ++q) {
    random_stream random{seed, std::uint64_t(q)};
    point_vector<S, T::static_dimension> query = other.col(q) * scale;
    if (q % 2 == 0 && points.cols() > 0) query = points.col(random.below(points.cols()));
    const neighborhood_spec specs[] = {knn{1}, knn{1 + random.below(30)},
                                       knn{65 + random.below(100)}, radius{random.uniform(0, 1)},
                                       knn_in_radius{1 + random.below(40), random.uniform(0, 1)}};
    for (const auto& spec : specs) {
      tree.find(query, spec, found);
      truth.find(query, spec, expected);
      REQUIRE(found == expected);
    }
  }
}

}  // namespace

TEST_CASE_TEMPLATE("a tree finds what brute force finds, to the bit", T, ALL_SPACES) {
  expect_truth<T>(test::random_points<T>(2000, 1), 10);
  expect_truth<T>(test::random_points<T>(37, 2), 11);
}

TEST_CASE_TEMPLATE("equal distances are ordered by index, as in brute force", T, ALL_SPACES) {
  expect_truth<T>(lattice<T>(1500, 1), 20);
}

TEST_CASE_TEMPLATE("points on a line and doubled points are found", T, ALL_SPACES) {
  expect_truth<T>(doubled_line<T>(600), 30);
}

TEST_CASE_TEMPLATE("any number of equal points is searchable", T, ALL_SPACES) {
  const matrix_of<T> points = matrix_of<T>::Constant(T::dimension, 3000, 1);
  const kd_tree tree{points};
  const auto found = tree.find(points.col(0), knn{70});
  REQUIRE(found.size() == 70);
  for (std::size_t i = 0; i < found.size(); ++i)
    CHECK((found[i].index == index_t(i) && found[i].distance == 0));
  CHECK(tree.find(points.col(0), radius{0}).size() == 3000);
}

TEST_CASE_TEMPLATE("points that are not finite are never found, and indices count them", T,
                   ALL_SPACES) {
  expect_truth<T>(with_holes<T>(test::random_points<T>(500, 4)), 40);
  const matrix_of<T> nothing =
      matrix_of<T>::Constant(T::dimension, 9, test::nan<typename T::scalar>);
  const kd_tree tree{nothing};
  CHECK(tree.size() == 9);
  CHECK_FALSE(tree.nearest(test::random_points<T>(1).col(0)));
}

TEST_CASE_TEMPLATE("a query that is not finite has no neighbors", T, ALL_SPACES) {
  const auto points = test::random_points<T>(50);
  const kd_tree tree{points};
  point_vector<typename T::scalar, T::static_dimension> query = points.col(0);
  query[T::dimension - 1] = test::nan<typename T::scalar>;
  CHECK(tree.find(query, knn{5}).empty());
  CHECK_FALSE(tree.nearest(query));
  query[T::dimension - 1] = test::infinity<typename T::scalar>;
  CHECK(tree.find(query, radius{test::infinity<double>}).empty());
}

TEST_CASE_TEMPLATE("a tree of nothing finds nothing, and one of one point that point", T,
                   ALL_SPACES) {
  const matrix_of<T> none(T::dimension, 0);
  const kd_tree empty{none};
  const auto query = test::random_points<T>(1);
  CHECK(empty.size() == 0);
  CHECK(empty.find(query.col(0), knn{3}).empty());
  CHECK(empty.find(query.col(0), radius{10}).empty());
  CHECK(empty.find_all(as_points(query), knn{3}).total() == 0);
  const kd_tree one{query};
  CHECK(one.nearest(query.col(0)) == neighbor<typename T::scalar>{0, 0});
  CHECK(one.find(query.col(0), knn{5}).size() == 1);
}

TEST_CASE_TEMPLATE("k of 0 is refused, and k beyond N finds all", T, test::f3, test::dx) {
  const auto points = test::random_points<T>(40);
  const kd_tree tree{points};
  CHECK_THROWS_WITH_AS((void)tree.find(points.col(0), knn{0}),
                       "knn: k must be at least 1, and is 0", invalid_input);
  CHECK(tree.find(points.col(0), knn{41}).size() == 40);
  CHECK(tree.find(points.col(0), knn{std::numeric_limits<index_t>::max()}).size() == 40);
  CHECK(tree.find_all(as_points(points), knn{1000}).total() == 1600);
}

TEST_CASE_TEMPLATE("a radius is a plain distance, and a point exactly there belongs to it", T,
                   test::f2, test::d3) {
  matrix_of<T> points = matrix_of<T>::Zero(T::dimension, 4);
  points.row(0) << 0, 3, 5, 7;
  const kd_tree tree{points};
  CHECK(tree.find(points.col(0), radius{5}).size() == 3);
  CHECK(tree.find(points.col(0), radius{4.999}).size() == 2);
  CHECK(tree.find(points.col(0), radius{0}).size() == 1);
  CHECK(tree.find(points.col(0), knn_in_radius{2, 5}).size() == 2);
  CHECK(tree.find(points.col(0), knn_in_radius{9, 3}).size() == 2);
  CHECK(tree.find(points.col(0), radius{5})[2].distance == 5);
}

TEST_CASE_TEMPLATE("a batch answers as single queries do, for any number of threads", T,
                   ALL_SPACES) {
  using S = typename T::scalar;
  const auto points = with_holes<T>(test::random_points<T>(1200, 5));
  const auto queries = with_holes<T>(test::random_points<T>(700, 6));
  const kd_tree tree{points};
  std::vector<neighbor<S>> one;
  for (const neighborhood_spec spec :
       {neighborhood_spec{knn{7}}, {radius{0.3}}, {knn_in_radius{5, 0.4}}})
    for (const int threads : {1, 2, 5}) {
      const auto all = tree.find_all(as_points(queries), spec, {.threads = threads});
      REQUIRE(all.size() == queries.cols());
      for (index_t q = 0; q < all.size(); ++q) {
        tree.find(queries.col(q), spec, one);
        REQUIRE(std::vector(all[q].begin(), all[q].end()) == one);
      }
    }
}

TEST_CASE("a tree over padded records looks only at the points in them") {
  Eigen::MatrixXf records = Eigen::MatrixXf::Random(6, 200);
  const points_view<float, 3> view{records.data(), 200, 6};
  const kd_tree tree{view};
  const Eigen::Matrix3Xf packed = records.topRows(3);
  const kd_tree other{packed};
  for (index_t i = 0; i < 200; ++i)
    CHECK(tree.find(packed.col(i), knn{4}) == other.find(packed.col(i), knn{4}));
}

TEST_CASE("a tree does not look at its points again: they may change and go") {
  auto points = std::optional{test::random_points<test::d3>(100)};
  const Eigen::Vector3d query = points->col(42);
  const kd_tree tree{*points};
  points->setZero();
  CHECK(tree.nearest(query)->index == 42);
  points.reset();
  CHECK(tree.nearest(query)->index == 42);
  const kd_tree of_temporary{test::random_points<test::d3>(100)};
  CHECK(of_temporary.nearest(query)->index == 42);
}

TEST_CASE("copies of a tree share it, and outlive the original") {
  auto tree = std::optional{kd_tree<float, 2>{test::random_points<test::f2>(60)}};
  const auto copy = *tree;
  CHECK(copy.memory() == tree->memory());
  tree.reset();
  CHECK(copy.nearest(test::random_points<test::f2>(60).col(7))->index == 7);
}

TEST_CASE("far from the origin distances lose what the coordinates have lost, and no more") {
  auto points = test::random_points<test::d3>(500, 9);
  points.array() += 1e6;
  const kd_tree tree{points};
  const brute_force_searcher truth{points};
  std::vector<neighbor<double>> expected;
  for (index_t i = 0; i < 500; ++i) {
    truth.find(points.col(i), knn{8}, expected);
    CHECK(tree.find(points.col(i), knn{8}) == expected);
  }
}

TEST_CASE("coordinates whose squares would overflow are treated as not finite") {
  Eigen::Matrix3Xf points = test::random_points<test::f3>(5);
  points(0, 2) = 1e30f;
  const kd_tree tree{points};
  CHECK(tree.find(points.col(0), radius{test::infinity<double>}).size() == 4);
  CHECK(tree.find(points.col(2), knn{1}).empty());
  points(0, 2) = largest_searchable_coordinate<float>(3);
  const kd_tree within{points};
  CHECK(within.find(points.col(2), knn{5}).size() == 5);
}

TEST_CASE("points spread over all magnitudes are searchable") {
  Eigen::Matrix2Xd points(2, 600);
  for (index_t i = 0; i < 600; ++i) points.col(i).setConstant(std::ldexp(1.0, int(i) - 300));
  const kd_tree tree{points, {.max_leaf_size = 1}};
  for (index_t i = 0; i < 600; ++i) CHECK(tree.nearest(points.col(i))->index == i);
}

TEST_CASE("what cannot be searched for is refused") {
  const auto points = test::random_points<test::fx>(20);
  const kd_tree tree{points};
  const Eigen::VectorXf short_query = Eigen::VectorXf::Zero(2);
  CHECK_THROWS_AS((void)tree.find(short_query, knn{1}), invalid_input);
  const Eigen::MatrixXf short_queries = Eigen::MatrixXf::Zero(2, 3);
  CHECK_THROWS_AS((void)tree.find_all(as_points(short_queries), knn{1}), invalid_input);
  CHECK_THROWS_AS((void)find_neighborhoods(tree, short_queries, knn{1}), invalid_input);
  CHECK_THROWS_AS((void)tree.find(points.col(0), knn{-1}), invalid_input);
  CHECK_THROWS_AS((void)tree.find(points.col(0), radius{-0.5}), invalid_input);
  CHECK_THROWS_AS((void)tree.find(points.col(0), radius{test::nan<double>}), invalid_input);
  CHECK_THROWS_AS((kd_tree{points, {.max_leaf_size = 0}}), invalid_input);
  const Eigen::MatrixXf flat(0, 5);
  CHECK_THROWS_AS(kd_tree{flat}, invalid_input);
}

TEST_CASE("a batch that is stopped throws `cancelled`") {
  const auto points = test::random_points<test::f3>(5000);
  const kd_tree tree{points};
  std::stop_source stop;
  stop.request_stop();
  const execution how{.monitor = {.stop = stop.get_token()}};
  CHECK_THROWS_AS((void)tree.find_all(as_points(points), knn{5}, how), cancelled);
  CHECK_THROWS_AS((void)tree.find_all(as_points(points), radius{0.1}, how), cancelled);
}

TEST_CASE_TEMPLATE("a tree is the same for any number of threads that build it", T, ALL_SPACES) {
  using S = typename T::scalar;
  const auto points = lattice<T>(3000, 7);
  const kd_tree one{points, {.threads = 1}};
  for (const int threads : {2, 5}) {
    const kd_tree other{points, {.threads = threads}};
    CHECK(other.memory() == one.memory());
    std::vector<neighbor<S>> found, expected;
    for (index_t i = 0; i < 200; ++i) {
      one.find(points.col(i), knn{20}, expected);
      other.find(points.col(i), knn{20}, found);
      REQUIRE(found == expected);
    }
  }
}

TEST_CASE_TEMPLATE("a large tree is the same for any number of threads, also of points in a row", T,
                   ALL_SPACES) {
  // Large enough that threads share the first nodes.
  for (const bool in_a_row : {false, true}) {
    auto points = in_a_row ? doubled_line<T>(100'000) : lattice<T>(100'000, 9);
    points.col(77'777).setConstant(test::nan<typename T::scalar>);
    const auto order_of = [&](int threads) {
      const kd_tree tree{points, {.threads = threads}};
      // Queries are visited as they lie in the tree.
      std::vector<std::int32_t> order;
      visit_neighborhoods(tree, points, knn{1},
                          [&](const neighborhood_block<typename T::scalar>& block) {
                            for (index_t i = 0; i < block.size(); ++i) {
                              order.push_back(std::int32_t(block.query(i)));
                              for (const auto near : block[i].indices()) order.push_back(near);
                            }
                          },
                          {.threads = 1});
      return order;
    };
    const auto expected = order_of(1);
    for (const int threads : {2, 16}) CHECK((order_of(threads) == expected));
  }
}

TEST_CASE("a tree says how much memory it holds") {
  const kd_tree tree{test::random_points<test::f3>(100000)};
  CHECK(tree.memory() > 100000 * 16);
  CHECK(tree.memory() < 100000 * 22);
  CHECK(kd_tree{test::random_points<test::f3>(0)}.memory() < 1000);
}

TEST_CASE("building reports its progress, and can be stopped") {
  const auto points = test::random_points<test::f3>(20000);
  std::vector<double> shares;
  const kd_tree tree{points, {.monitor = {.progress = [&](double s) { shares.push_back(s); }}}};
  REQUIRE(shares.size() > 3);
  CHECK(std::ranges::is_sorted(shares));
  CHECK(shares.back() == 1);
  std::stop_source stop;
  stop.request_stop();
  CHECK_THROWS_AS((kd_tree{points, {.monitor = {.stop = stop.get_token()}}}), cancelled);
}

TEST_CASE_TEMPLATE("leaves of any size give the same neighbors", T, test::f2, test::d3, test::dx) {
  const auto points = test::random_points<T>(777, 8);
  const kd_tree tree{points};
  for (const int size : {1, 2, 100, 10000}) {
    const kd_tree other{points, {.max_leaf_size = size}};
    for (index_t i = 0; i < 50; ++i)
      REQUIRE(other.find(points.col(i), knn{9}) == tree.find(points.col(i), knn{9}));
  }
}

TEST_CASE_TEMPLATE("the nearest two are those of a search for two", T, test::f2, test::f3, test::f5,
                   test::fx, test::d2, test::d3, test::dx) {
  using S = typename T::scalar;
  auto points = test::random_points<T>(300);
  points.rightCols(100) = points.leftCols(100);  // Ties.
  points(0, 5) = test::nan<S>;
  const kd_tree tree{points};
  auto queries = test::random_points<T>(100, 1);
  queries.col(3) = points.col(7);
  for (const auto& q : queries.colwise()) {
    const point_vector<S, T::static_dimension> query = q;
    for (const double limit : {test::infinity<double>, 0.3, 0.0}) {
      const auto expected = tree.find(query, knn_in_radius{2, limit});
      const auto found = tree.nearest_two(query, S(limit));
      for (std::size_t i = 0; i < 2; ++i)
        CHECK(found[i] == (i < expected.size() ? expected[i] : neighbor<S>{-1, test::infinity<S>}));
    }
  }
  point_vector<S, T::static_dimension> query = queries.col(0);
  query[0] = test::nan<S>;
  CHECK(tree.nearest_two(query)[0].index == -1);
  query[0] = 0;
  CHECK_THROWS_AS((void)tree.nearest_two(query, S(-1)), invalid_input);
  const decltype(points) none(T::dimension, 0);
  CHECK(kd_tree{none}.nearest_two(query)[0].index == -1);
}

TEST_CASE_TEMPLATE("what a search says is so far away is found within so far", S, float, double) {
  const auto points = test::random_points<test::space<S, 3>>(2000, 5, 0, 1);
  const kd_tree tree{points};
  const brute_force_searcher brute{points};
  index_t lost = 0;
  std::vector<neighbor<S>> found;
  for (index_t i = 0; i < points.cols(); ++i) {
    const Eigen::Matrix<S, 3, 1> query = points.col(i);
    const auto near = tree.find(query, knn{8});
    const double reach = double(near.back().distance);
    brute.find(query, radius{reach}, found);
    lost += std::ssize(found) < 8;
    lost += std::ssize(tree.find(query, radius{reach})) < 8;
    lost += std::ssize(tree.find(query, knn_in_radius{8, reach})) < 8;
    lost += tree.nearest_two(query, near[1].distance)[1].index < 0;
  }
  CHECK(lost == 0);
  // On a lattice, by the diagonals.
  Eigen::Matrix<S, 3, dynamic> lattice(3, 27);
  for (int i = 0; i < 27; ++i) lattice.col(i) << S(i % 3), S(i / 3 % 3), S(i / 9);
  const Eigen::Matrix<S, 3, 1> middle = lattice.col(13);
  CHECK(kd_tree{lattice}.find(middle, radius{double(std::sqrt(S(2)))}).size() == 19);
  CHECK(kd_tree{lattice}.find(middle, radius{double(std::sqrt(S(3)))}).size() == 27);
}
