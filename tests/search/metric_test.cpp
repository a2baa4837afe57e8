// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

/// Poses of a robot in the plane: x and y in metres, then an angle, of which a radian counts two
/// metres.
struct pose_distance {
  template <class S>
  static S term(S difference, index_t axis) {
    return axis < 2 ? difference * difference : 4 * so2::term(difference, axis);
  }
  template <class S>
  static S term_to(S value, S low, S high, index_t axis) {
    if (axis == 2) return 4 * so2::term_to(value, low, high, axis);
    const S outside = std::max({low - value, value - high, S(0)});
    return outside * outside;
  }
  template <class S>
  static S distance(S sum) {
    return std::sqrt(sum);
  }
  template <class S>
  static S sum(S distance) {
    return distance * distance;
  }
  static constexpr int dimension = 3;
};
static_assert(CoordinateMetric<pose_distance, float> && CoordinateMetric<pose_distance, double>);

/// A weight per coordinate: a metric with a state.
struct weighted {
  std::vector<double> weights;
  template <class S>
  S term(S difference, index_t axis) const {
    return S(weights[std::size_t(axis)]) * std::abs(difference);
  }
  template <class S>
  static S distance(S sum) {
    return sum;
  }
  template <class S>
  static S sum(S distance) {
    return distance;
  }
};

/// The tree finds what brute force finds, to the bit, a query and a specification at a time.
template <class T, class M>
void expect_truth(const point_matrix<typename T::scalar, T::static_dimension>& points,
                  const point_matrix<typename T::scalar, T::static_dimension>& queries,
                  const M& metric, double reach) {
  using S = typename T::scalar;
  const kd_tree tree{points, metric, {.max_leaf_size = 4}};
  const brute_force_searcher truth{points, metric};
  std::vector<neighbor<S>> found, expected;
  for (index_t q = 0; q < queries.cols(); ++q) {
    random_stream random{17, std::uint64_t(q)};
    for (const neighborhood_spec& spec :
         {neighborhood_spec{knn{1 + random.below(12)}},
          {radius{random.uniform(0, reach)}},
          {knn_in_radius{1 + random.below(9), random.uniform(0, reach)}}}) {
      tree.find(queries.col(q), spec, found);
      truth.find(queries.col(q), spec, expected);
      REQUIRE(found == expected);
    }
    if (q % 10 == 0) {
      tree.find(queries.col(q), knn{90}, found);
      truth.find(queries.col(q), knn{90}, expected);
      REQUIRE(found == expected);
    }
  }
  const auto all = tree.find_all(as_points(queries), knn{5}, {.threads = 2});
  for (index_t q = 0; q < queries.cols(); ++q) {
    truth.find(queries.col(q), knn{5}, expected);
    REQUIRE(std::ranges::equal(all[q], expected));
  }
}

/// Uniform over all rotations, either sign.
template <class T>
point_matrix<typename T::scalar, T::static_dimension> quaternions(index_t count,
                                                                  std::uint64_t seed) {
  point_matrix<typename T::scalar, T::static_dimension> all(4, count);
  for (index_t i = 0; i < count; ++i) {
    random_stream random{seed, std::uint64_t(i)};
    Eigen::Vector4d q;
    for (auto& c : q) c = random.normal();
    all.col(i) = q.normalized().cast<typename T::scalar>();
  }
  return all;
}

using f1 = test::space<float, 1>;
using f4 = test::space<float, 4>;
using d4 = test::space<double, 4>;

}  // namespace

TEST_CASE_TEMPLATE("trees by every metric of coordinates find what brute force finds", T,
                   ALL_SPACES) {
  const auto points = test::random_points<T>(700, 1);
  const auto queries = test::random_points<T>(1000, 2, -1.3, 1.3);
  expect_truth<T>(points, queries, manhattan{}, 1);
  expect_truth<T>(points, queries, chebyshev{}, 0.6);
  expect_truth<T>(points, queries, euclidean{}, 0.8);
  weighted metric{std::vector<double>(T::dimension)};
  for (int d = 0; d < T::dimension; ++d) metric.weights[std::size_t(d)] = d;
  expect_truth<T>(points, queries, metric, 1);
}

TEST_CASE_TEMPLATE("trees of angles wrap around, wherever the angles lie", T, f1, ALL_SPACES) {
  expect_truth<T>(test::random_points<T>(500, 3, -3.15, 3.15),
                  test::random_points<T>(1000, 4, -3.15, 3.15), so2{}, 2);
  expect_truth<T>(test::random_points<T>(500, 5, -20, 50), test::random_points<T>(1000, 6, -70, 20),
                  so2{}, 2);
  expect_truth<T>(test::random_points<T>(500, 7, 3.0, 3.3),
                  test::random_points<T>(1000, 8, -3.3, -3.0), so2{}, 0.5);
}

TEST_CASE_TEMPLATE("trees of rotations find the same for q and -q", T, f4, d4, test::fx, test::dx) {
  auto points = quaternions<T>(800, 1);
  auto queries = quaternions<T>(1000, 2);
  // Half of the queries close to a point, some orthogonal to many, some equal.
  for (index_t q = 0; q < 400; ++q)
    queries.col(q) = (points.col(q) * (q % 2 ? 1 : -1) + queries.col(q) / 50).normalized();
  points.col(0) << 1, 0, 0, 0;
  points.col(1) << 0, 1, 0, 0;
  queries.col(0) << 0, 0, 1, 0;
  expect_truth<T>(points, queries, so3{}, 1.5);
  const kd_tree tree{points, so3{}};
  for (index_t q = 0; q < 200; ++q) {
    const point_vector<typename T::scalar, T::static_dimension> opposite = -queries.col(q);
    CHECK(tree.find(queries.col(q), knn{7}) == tree.find(opposite, knn{7}));
  }
  CHECK(tree.find(queries.col(0), radius{std::numbers::pi}).size() == 800);
}

TEST_CASE_TEMPLATE("a metric of your own serves in trees, whether or not it wraps", T, test::f3,
                   test::d3) {
  auto points = test::random_points<T>(600, 9, -3, 3);
  auto queries = test::random_points<T>(1000, 10, -4, 4);
  points.row(2) *= 3;
  expect_truth<T>(points, queries, pose_distance{}, 3);
  CHECK(check_neighbor_searcher(kd_tree{points, pose_distance{}}, points, {}, pose_distance{})
            .empty());
}

TEST_CASE_TEMPLATE("any function of two points is a metric of brute force", T, ALL_SPACES) {
  using S = typename T::scalar;
  const auto points = test::random_points<T>(200, 11);
  // Not a sum over coordinates: the sine of the angle between directions.
  const auto between = [](const auto& a, const auto& b) {
    const S cosine = a.normalized().dot(b.normalized());
    return std::sqrt(std::max(S(0), 1 - cosine * cosine));
  };
  const brute_force_searcher searcher{points, between};
  std::vector<neighbor<S>> found;
  searcher.find(points.col(5), knn{3}, found);
  REQUIRE(found.size() == 3);
  for (const auto& n : found) {
    index_t nearer = 0;
    for (index_t i = 0; i < 200; ++i) nearer += between(points.col(i), points.col(5)) < n.distance;
    CHECK(nearer == &n - found.data());
  }
}

TEST_CASE("reported distances are plain, in the units that each metric states") {
  Eigen::Matrix2Xd points(2, 1);
  points << 3, -4;
  const Eigen::Vector2d query = Eigen::Vector2d::Zero();
  CHECK(kd_tree{points}.nearest(query)->distance == 5);
  CHECK(kd_tree{points, manhattan{}}.nearest(query)->distance == 7);
  CHECK(kd_tree{points, chebyshev{}}.nearest(query)->distance == 4);

  Eigen::Matrix<double, 1, -1, Eigen::RowMajor> angle(1, 1);
  angle << 3;
  const Eigen::Matrix<double, 1, 1> other{-3};
  CHECK(kd_tree{angle, so2{}}.nearest(other)->distance ==
        doctest::Approx(2 * std::numbers::pi - 6).epsilon(1e-14));

  for (const double turn : {1e-7, 0.5, 2.0, 3.1415}) {
    Eigen::Matrix4Xd rotation(4, 1);
    rotation.col(0) =
        Eigen::Quaterniond{Eigen::AngleAxisd{turn, Eigen::Vector3d::UnitY()}}.coeffs();
    for (const double sign : {1.0, -1.0}) {
      const Eigen::Vector4d identity{0, 0, 0, sign};
      const kd_tree tree{rotation, so3{}};
      CHECK(tree.nearest(identity)->distance == doctest::Approx(turn).epsilon(1e-9));
      CHECK(tree.find(identity, radius{turn * 1.0001}).size() == 1);
      CHECK(tree.find(identity, radius{turn * 0.9999}).empty());
    }
  }
}

TEST_CASE("a metric for one dimension refuses points of another") {
  const auto points = test::random_points<test::f3>(10);
  CHECK_THROWS_WITH_AS((kd_tree{points, so3{}}),
                       "the metric is for points of 4 coordinates, not of 3", invalid_input);
  CHECK_THROWS_AS((brute_force_searcher{points, so3{}}), invalid_input);
}

namespace {

/// A metric with a fault that can be chosen.
struct faulty {
  enum class fault { none, negative, one_way, no_inverse, shrinking };
  fault f = fault::none;
  template <class S>
  S term(S difference, index_t) const {
    if (f == fault::negative) return -std::abs(difference);
    if (f == fault::one_way) return difference > 0 ? difference : -2 * difference;
    if (f == fault::shrinking) return difference == 0 ? S(0) : 1 / (1 + std::abs(difference));
    return std::abs(difference);
  }
  template <class S>
  S distance(S sum) const {
    return sum;
  }
  template <class S>
  S sum(S distance) const {
    return f == fault::no_inverse ? 2 * distance : distance;
  }
};

}  // namespace

TEST_CASE("the shipped metrics keep their contract, and a broken rule is named") {
  const auto points = test::random_points<test::d3>(200, 12, -3, 3);
  CHECK(check_metric(euclidean{}, points).empty());
  CHECK(check_metric(manhattan{}, points).empty());
  CHECK(check_metric(chebyshev{}, points).empty());
  CHECK(check_metric(so2{}, points).empty());
  CHECK(check_metric(pose_distance{}, points).empty());
  CHECK(check_metric(so3{}, quaternions<d4>(200, 3)).empty());
  CHECK(check_metric(faulty{}, points).empty());
  const auto names = [&](faulty::fault f, const char* rule) {
    for (const auto& violation : check_metric(faulty{f}, points))
      if (violation.find(rule) != std::string::npos) return true;
    return false;
  };
  CHECK(names(faulty::fault::negative, "a sum is negative"));
  CHECK(names(faulty::fault::one_way, "the distance from a to b is not that from b to a"));
  CHECK(names(faulty::fault::no_inverse, "not the inverse"));
  CHECK(names(faulty::fault::shrinking, "the neighbors are not the nearest points"));
}
