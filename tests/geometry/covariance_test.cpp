// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

/// Normally distributed around the origin, with standard deviation 1.
template <class T>
auto normal_points(index_t count, std::uint64_t seed) {
  point_matrix<typename T::scalar, T::static_dimension> points(T::dimension, count);
  for (index_t i = 0; i < count; ++i) {
    random_stream random{seed, std::uint64_t(i)};
    for (index_t d = 0; d < T::dimension; ++d) points(d, i) = typename T::scalar(random.normal());
  }
  return points;
}

/// The smallest determinant of all subsets of `h` points, by looking at each.
template <class M>
double least_determinant(const M& points, index_t h) {
  std::vector<bool> chosen(std::size_t(points.cols()));
  std::fill(chosen.begin(), chosen.begin() + h, true);
  double least = std::numeric_limits<double>::infinity();
  do {
    std::vector<index_t> subset;
    for (index_t i = 0; i < points.cols(); ++i)
      if (chosen[std::size_t(i)]) subset.push_back(i);
    const auto found = mean_and_covariance(points, subset);
    least = std::min(least, determinant(found->covariance.template cast<double>()));
  } while (std::prev_permutation(chosen.begin(), chosen.end()));
  return least;
}

}  // namespace

static_assert(CovarianceEstimator<sample_covariance, double, 5>);
static_assert(CovarianceEstimator<minimum_covariance_determinant, float, dynamic>);
static_assert(!CovarianceEstimator<int, float, 3>);
static_assert(!CovarianceEstimator<decltype([](points_view<float, 3>) { return 1; }), float, 3>);

TEST_CASE("chi-square quantiles are those of the tables") {
  // Abramowitz & Stegun, table 26.8.
  CHECK(chi_square_quantile(0.975, 2) == doctest::Approx(7.37776).epsilon(1e-6));
  CHECK(chi_square_quantile(0.975, 3) == doctest::Approx(9.34840).epsilon(1e-6));
  CHECK(chi_square_quantile(0.95, 10) == doctest::Approx(18.3070).epsilon(1e-5));
  CHECK(chi_square_quantile(0.5, 1) == doctest::Approx(0.454936).epsilon(1e-6));
  CHECK(chi_square_quantile(0.005, 30) == doctest::Approx(13.7867).epsilon(1e-5));
  // Two degrees of freedom have a closed form.
  for (const double p : {1e-12, 1e-3, 0.3, 0.9, 1 - 1e-9})
    CHECK(chi_square_quantile(p, 2) == doctest::Approx(-2 * std::log1p(-p)).epsilon(1e-6));
  for (const index_t dof : {1, 2, 7, 100, 5000})
    for (const double p : {1e-6, 0.1, 0.5, 0.999})
      CHECK(chi_square_probability(chi_square_quantile(p, dof), dof) ==
            doctest::Approx(p).epsilon(1e-9));
  CHECK_THROWS_AS((void)chi_square_quantile(1, 3), invalid_input);
  CHECK_THROWS_AS((void)chi_square_quantile(test::nan<double>, 3), invalid_input);
  CHECK_THROWS_AS((void)chi_square_quantile(0.5, 0), invalid_input);
}

TEST_CASE_TEMPLATE("the subset found is the one with the smallest determinant of all", T, test::f2,
                   test::f3, test::d2, test::d3) {
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    auto points = test::random_points<T>(12, seed);
    points.leftCols(2) *= 5;
    const index_t h = 9;
    const auto found = mean_and_covariance(points, minimum_covariance_determinant{.trials = 100});
    REQUIRE(found);
    CHECK(found->count == h);
    const double share = double(h) / 12;
    const double scale =
        share / chi_square_probability(chi_square_quantile(share, T::dimension), T::dimension + 2);
    CHECK(determinant(found->covariance.template cast<double>()) ==
          doctest::Approx(least_determinant(points, h) * std::pow(scale, T::dimension))
              .epsilon(1e-4));
  }
}

TEST_CASE_TEMPLATE("a third of the points may be anywhere", T, ALL_SPACES) {
  for (const index_t n : {60, 500, 3000}) {
    auto points = normal_points<T>(n, 1);
    points.rightCols(n / 3).array() += 50;
    points(0, 3) = test::nan<typename T::scalar>;
    const auto robust =
        mean_and_covariance(points, minimum_covariance_determinant{.share = 0.6, .seed = 7});
    REQUIRE(robust);
    CHECK(double(robust->mean.norm()) < 4 * T::dimension / std::sqrt(0.6 * double(n)));
    const auto plain = mean_and_covariance(points, sample_covariance{});
    CHECK(plain->mean.norm() > 10);
  }
}

TEST_CASE_TEMPLATE("the covariance of normally distributed points is theirs", T, ALL_SPACES) {
  const auto points = normal_points<T>(8000, 2);
  const auto found = mean_and_covariance(points, minimum_covariance_determinant{.share = 0.75});
  const auto identity = Eigen::MatrixXd::Identity(T::dimension, T::dimension);
  CHECK((found->covariance - identity).cwiseAbs().maxCoeff() < 0.1);
  const auto all = mean_and_covariance(
      points,
      minimum_covariance_determinant{.rejection = chi_square_quantile(0.975, T::dimension)});
  CHECK(double(all->count) == doctest::Approx(0.975 * 8000).epsilon(0.01));
}

TEST_CASE_TEMPLATE("rejection keeps every good point and no other", T, test::f2, test::d3,
                   test::dx) {
  auto points = normal_points<T>(200, 3);
  points.rightCols(40).array() += 30;
  const auto found = mean_and_covariance(
      points,
      minimum_covariance_determinant{.rejection = chi_square_quantile(1 - 1e-9, T::dimension)});
  CHECK(found->count == 160);
  const auto good = mean_and_covariance(points.leftCols(160).eval());
  CHECK(found->mean.isApprox(good->mean, 1e-4f));
  CHECK(found->covariance.isApprox(good->covariance, 1e-4f));
  const auto distances = mahalanobis_distances(points, *found);
  for (index_t i = 0; i < 200; ++i) CHECK((distances[i] < 7) == (i < 160));
}

TEST_CASE_TEMPLATE("a flat majority gives the covariance of its plane", T, test::f3, test::d3) {
  auto points = test::random_points<T>(40, 4);
  points.row(2).head(30).setConstant(2);
  points.rightCols(10).row(2).array() += 5;
  for (const auto& rejection : {std::optional<double>{}, std::optional{12.0}}) {
    const auto found = mean_and_covariance(
        points, minimum_covariance_determinant{.share = 0.7, .rejection = rejection});
    REQUIRE(found);
    CHECK(found->mean[2] == 2);
    CHECK(found->covariance.row(2).isZero(0));
    CHECK(found->covariance(0, 0) > 0.1);
  }
}

TEST_CASE_TEMPLATE("few, equal or no points have a documented result", T, ALL_SPACES) {
  using S = typename T::scalar;
  using matrix = point_matrix<S, T::static_dimension>;
  const minimum_covariance_determinant robust;
  CHECK_FALSE(mean_and_covariance(matrix(T::dimension, 0), robust));
  CHECK_FALSE(mean_and_covariance(matrix::Constant(T::dimension, 5, test::nan<S>).eval(), robust));
  const auto one = mean_and_covariance(test::random_points<T>(1), robust);
  CHECK(one->count == 1);
  CHECK(one->covariance.isZero(0));
  const auto few = test::random_points<T>(T::dimension);
  CHECK(mean_and_covariance(few, robust)
            ->covariance.isApprox(mean_and_covariance(few)->covariance, 1e-4));
  const auto same = mean_and_covariance(matrix::Constant(T::dimension, 50, S(3)).eval(), robust);
  CHECK(same->mean.isApproxToConstant(3));
  CHECK(same->covariance.isZero(0));
}

TEST_CASE("the seed decides, and nothing else") {
  const auto points = test::random_points<test::dx>(40, 5);
  const auto find = [&](std::uint64_t seed) {
    return *mean_and_covariance(points, minimum_covariance_determinant{.trials = 1, .seed = seed});
  };
  CHECK(find(4).covariance == find(4).covariance);
  CHECK(find(4).covariance != find(5).covariance);
}

TEST_CASE("options of the robust covariance that make no sense are refused") {
  const auto points = test::random_points<test::f2>(30);
  for (const auto& bad :
       {minimum_covariance_determinant{.share = 0.4}, minimum_covariance_determinant{.share = 1.1},
        minimum_covariance_determinant{.trials = 0},
        minimum_covariance_determinant{.rejection = -1},
        minimum_covariance_determinant{.share = test::nan<double>}})
    CHECK_THROWS_AS((void)mean_and_covariance(points, bad), invalid_input);
}

TEST_CASE_TEMPLATE("Mahalanobis distances are those of the formula", T, ALL_SPACES) {
  using S = typename T::scalar;
  auto points = test::random_points<T>(100, 6);
  const auto found = *mean_and_covariance(points);
  const Eigen::MatrixXd inverse = *solve(found.covariance.template cast<double>(),
                                         Eigen::MatrixXd::Identity(T::dimension, T::dimension));
  points(1, 5) = test::nan<S>;
  const auto distances = mahalanobis_distances(points, found);
  for (index_t i = 0; i < 100; ++i) {
    if (i == 5) continue;
    const Eigen::VectorXd x = (points.col(i) - found.mean).template cast<double>();
    CHECK(double(distances[i]) == doctest::Approx(std::sqrt(x.dot(inverse * x))).epsilon(1e-3));
  }
  CHECK(std::isnan(distances[5]));
  Eigen::Matrix2Xd flat(2, 3);
  flat << 0, 1, 5, 0, 0, 1;
  const auto line = *mean_and_covariance(flat.leftCols(2).eval());
  const auto from_line = mahalanobis_distances(flat, line);
  CHECK(from_line[0] == doctest::Approx(std::sqrt(0.5)));
  CHECK(std::isinf(from_line[2]));
}

TEST_CASE_TEMPLATE("normals by the sample covariance are those by default", T, ALL_SPACES) {
  using S = typename T::scalar;
  auto points = test::random_points<T>(400, 7);
  points.row(T::dimension - 1) *= S(0.05);
  points(0, 9) = test::nan<S>;
  const auto by_default = estimate_normals(points, knn{12});
  const auto by_estimator = estimate_normals(points, knn{12}, sample_covariance{});
  const double close = std::is_same_v<S, float> ? 1e-3 : 1e-9;
  for (index_t i = 0; i < 400; ++i)
    CHECK(double((by_default.normals.col(i) - by_estimator.normals.col(i)).norm()) < close);
  const kd_tree tree{points};
  const auto near = tree.find_all(as_points(points), knn{12});
  CHECK(estimate_normals(points, near, sample_covariance{}).normals == by_estimator.normals);
}

TEST_CASE_TEMPLATE("robust normals ignore clutter that turns plain ones", T, test::f3, test::d3) {
  using S = typename T::scalar;
  auto points = test::random_points<T>(900, 8);
  points.row(2).setZero();
  for (index_t i = 0; i < 900; i += 6) points(2, i) = S(0.02 + 0.1 * double(i % 7));
  const auto worst = [&](const auto& found) {
    S least = 1;
    for (index_t i = 1; i < 900; i += 6) least = std::min(least, std::abs(found.normals(2, i)));
    return std::acos(double(std::min(least, S(1))));
  };
  const auto plain = estimate_normals(points, knn{30});
  const auto robust =
      estimate_normals(points, knn{30}, minimum_covariance_determinant{.share = 0.6, .trials = 40});
  CHECK(worst(plain) > 0.15);
  CHECK(worst(robust) < 0.02);
  for (const int threads : {1, 2, 5})
    CHECK(estimate_normals(points, knn{30},
                           minimum_covariance_determinant{.share = 0.6, .trials = 40},
                           {.threads = threads})
              .normals == robust.normals);
}

TEST_CASE("an estimator of your own decides, also that there is no answer") {
  const auto points = test::random_points<test::f3>(50, 9);
  const auto upwards = [](points_view<float, 3> all,
                          std::span<const std::int32_t> near) -> std::optional<moments<float, 3>> {
    if (near.front() % 2 == 0) return std::nullopt;
    return moments<float, 3>{std::ssize(near), all[near.front()],
                             Eigen::Vector3d{1, 1, 0}.asDiagonal().toDenseMatrix()};
  };
  const auto found = estimate_normals(points, knn{5}, upwards);
  CHECK(found.undetermined() == 25);
  for (index_t i = 1; i < 50; i += 2) CHECK(found.normals.col(i) == Eigen::Vector3f::UnitZ());
}

TEST_CASE_TEMPLATE("the shipped estimators keep their contract, and a broken rule is named", T,
                   ALL_SPACES) {
  using S = typename T::scalar;
  constexpr int D = T::static_dimension;
  const auto points = test::random_points<T>(60, 10);
  CHECK(check_covariance_estimator(sample_covariance{}, points).empty());
  CHECK(check_covariance_estimator(minimum_covariance_determinant{}, points).empty());
  const auto violations = check_covariance_estimator(
      [&](points_view<S, D> all, std::span<const std::int32_t> some) {
        auto found =
            moments<S, D>{std::ssize(some) + 1, point_vector<S, D>::Zero(T::dimension),
                          Eigen::Matrix<double, D, D>::Identity(T::dimension, T::dimension)};
        for (const auto i : some) found.mean += all[i];
        found.covariance(0, 1) = -1;
        return found;
      },
      points);
  CHECK(violations.size() >= 4);
}
