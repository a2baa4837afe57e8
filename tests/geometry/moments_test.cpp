// SPDX-License-Identifier: MIT
#include <cmath>
#include <ranges>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

/// Straight from the definition, in long double.
template <class M>
auto defined_moments(const M& points) {
  using real = Eigen::Matrix<long double, dynamic, dynamic>;
  const real all = points.template cast<long double>();
  const Eigen::Matrix<long double, dynamic, 1> mean = all.rowwise().mean();
  const real centered = all.colwise() - mean;
  const real covariance = centered * centered.transpose() / (long double)(all.cols() - 1);
  return std::pair{Eigen::VectorXd{mean.template cast<double>()},
                   Eigen::MatrixXd{covariance.template cast<double>()}};
}

template <class S>
constexpr double rounding = sizeof(S) == 4 ? 1e-6 : 1e-14;

}  // namespace

TEST_CASE_TEMPLATE("mean and covariance are what they are defined to be", T, ALL_SPACES) {
  using S = typename T::scalar;
  const auto points = test::random_points<T>(3000);
  const auto found = mean_and_covariance(points);
  const auto [mean, covariance] = defined_moments(points);
  REQUIRE(found);
  CHECK(found->count == 3000);
  CHECK((found->mean.template cast<double>() - mean).norm() < rounding<S>);
  CHECK((found->covariance.template cast<double>() - covariance).norm() < rounding<S>);
}

TEST_CASE_TEMPLATE(
    "a million units away from the origin nothing but the coordinates' rounding is lost", T,
    ALL_SPACES) {
  using S = typename T::scalar;
  auto points = test::random_points<T>(3000);
  points.array() += S(1e6);
  const auto found = mean_and_covariance(points);
  const auto [mean, covariance] = defined_moments(points);
  CHECK((found->mean.template cast<double>() - mean).norm() < 1e6 * rounding<S>);
  CHECK((found->covariance.template cast<double>() - covariance).norm() < 10 * rounding<S>);
}

TEST_CASE_TEMPLATE("moments have the same bits for any number of threads", T, ALL_SPACES) {
  const auto points = test::random_points<T>(20'000, 5);
  const auto one = mean_and_covariance(points, {.threads = 1});
  for (const int threads : {2, 3, 8}) {
    const auto many = mean_and_covariance(points, {.threads = threads});
    CHECK(test::same_bits(many->mean, one->mean));
    CHECK(test::same_bits(many->covariance, one->covariance));
  }
}

TEST_CASE_TEMPLATE("moments of a subset are those of its points", T, ALL_SPACES) {
  using S = typename T::scalar;
  const auto points = test::random_points<T>(100, 6);
  const auto found = mean_and_covariance(points, std::views::iota(20, 50));
  const auto [mean, covariance] = defined_moments(points.middleCols(20, 30));
  CHECK(found->count == 30);
  CHECK((found->mean.template cast<double>() - mean).norm() < rounding<S>);
  CHECK((found->covariance.template cast<double>() - covariance).norm() < rounding<S>);

  const kd_tree tree{points};
  const auto near = tree.find_all(as_points(points), knn{10});
  std::vector<index_t> same;
  for (const auto& n : near[7]) same.push_back(n.index);
  CHECK(test::same_bits(mean_and_covariance(points, near[7])->covariance,
                        mean_and_covariance(points, same)->covariance));
}

TEST_CASE_TEMPLATE("points that are not finite do not count", T, ALL_SPACES) {
  auto points = test::random_points<T>(60, 7);
  const auto clean = mean_and_covariance(points.rightCols(58));
  points(0, 0) = test::nan<typename T::scalar>;
  points(T::dimension - 1, 1) = test::infinity<typename T::scalar>;
  const auto found = mean_and_covariance(points);
  CHECK(found->count == 58);
  CHECK(test::same_bits(found->mean, clean->mean));
  CHECK(test::same_bits(found->covariance, clean->covariance));
  CHECK_FALSE(mean_and_covariance(points.leftCols(2)));
}

TEST_CASE_TEMPLATE("no points have no moments, and one point has no spread", T, ALL_SPACES) {
  const auto points = test::random_points<T>(5, 8);
  CHECK_FALSE(mean_and_covariance(points.leftCols(0)));
  CHECK_FALSE(mean_and_covariance(points, std::vector<int>{}));
  const auto one = mean_and_covariance(points.leftCols(1));
  CHECK(one->count == 1);
  CHECK(test::same_bits(one->mean, points.col(0)));
  CHECK(one->covariance.isZero(0));
  CHECK(mean_and_covariance(points, std::vector{2, 2, 2})->covariance.isZero(0));
}

TEST_CASE("an index that is out of range is refused") {
  const auto points = test::random_points<test::f3>(5);
  CHECK_THROWS_AS((void)mean_and_covariance(points, std::vector{0, 5}), invalid_input);
  CHECK_THROWS_AS((void)mean_and_covariance(points, std::vector{-1}), invalid_input);
  CHECK_THROWS_AS((void)mean_and_covariance(points, std::vector{~0ull}), invalid_input);
}
