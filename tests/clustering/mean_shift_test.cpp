// SPDX-License-Identifier: MIT
#include <cmath>
#include <concepts>
#include <cstdint>
#include <vector>

#include "spaces.hpp"

import cilantro;
import clustering_support;
import test_support;

using namespace cilantro;

namespace {

/// The iteration as it is written in the paper, over all points.
template <class M, class K>
Eigen::VectorXd climb(const M& points, Eigen::VectorXd x, double bandwidth, const K& kernel,
                      int steps) {
  for (int step = 0; step < steps; ++step) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(x.size());
    double total = 0;
    for (index_t i = 0; i < points.cols(); ++i) {
      const Eigen::VectorXd p = points.col(i).template cast<double>();
      const double weight = kernel((p - x).norm() / bandwidth);
      sum += weight * p;
      total += weight;
    }
    const Eigen::VectorXd next = sum / total;
    if ((next - x).norm() < 1e-10) break;
    x = next;
  }
  return x;
}

struct without_end {
  static constexpr double support = 1;
  double operator()(double) const { return 1; }
};

}  // namespace

TEST_CASE_TEMPLATE("modes are where a direct iteration comes to rest", T, ALL_SPACES) {
  using S = typename T::scalar;
  const auto centers = test::corners<T>(3, 4);
  const auto points = test::blobs<T>(centers, 60, 1.0, 6);
  const auto check = [&](const auto& kernel) {
    const auto found =
        mean_shift(points, 0.8, kernel, {.tolerance = 1e-6, .max_iterations = 20000});
    for (index_t c = 0; c < found.size(); ++c) {
      const Eigen::VectorXd mode = found.modes.col(c).template cast<double>();
      const double rounding = sizeof(S) == 4 ? 2e-6 : 0;
      CHECK((climb(points, mode, 0.8, kernel, 1) - mode).norm() <= 1.01e-6 * 0.8 + rounding);
      if (std::same_as<decltype(kernel), const gaussian_kernel&>)
        CHECK((climb(points, mode, 0.8, kernel, 2000) - mode).norm() <
              (sizeof(S) == 4 ? 2e-4 : 2e-5));
    }
    for (const int threads : {1, 2, 5})
      CHECK(mean_shift(points, 0.8, kernel,
                       {.tolerance = 1e-6, .max_iterations = 20000, .threads = threads}) == found);
    return found;
  };
  const auto found = check(gaussian_kernel{});
  REQUIRE(found.size() == 3);
  CHECK(found.unconverged == 0);
  for (index_t i = 0; i < points.cols(); ++i)
    CHECK(found.labels()[std::size_t(i)] == found.labels()[std::size_t(i / 60 * 60)]);
  check(epanechnikov_kernel{});
  const auto exponential = [](double u) { return std::exp(-u); };
  CHECK(check(custom_kernel{exponential, test::infinity<double>}).size() >= 1);
}

TEST_CASE("the flat kernel finds the means of groups that are narrower than it") {
  const auto centers = test::corners<test::d2>(4, 10);
  const auto points = test::blobs<test::d2>(centers, 30, 1.0);
  const auto found = mean_shift(points, 3.0, flat_kernel{});
  REQUIRE(found.size() == 4);
  for (index_t c = 0; c < 4; ++c) {
    const index_t from = found[c].front() / 30;
    const Eigen::Vector2d mean = points.middleCols(30 * from, 30).rowwise().mean();
    CHECK((found.modes.col(c) - mean).norm() < 1e-9);
    CHECK(found.densities[std::size_t(c)] == 30);
  }
}

TEST_CASE("a second call starts afresh") {
  const auto points = test::random_points<test::f3>(50);
  const auto first = mean_shift(points, 0.3), second = mean_shift(points, 0.3);
  CHECK(first == second);
  index_t members = 0;
  for (const auto cluster : second) members += std::ssize(cluster);
  CHECK(members == 50);
}

TEST_CASE("seeds may lie anywhere; those without points around find nothing") {
  const auto centers = test::corners<test::d2>(2, 10);
  const auto points = test::blobs<test::d2>(centers, 40, 1.0);
  Eigen::Matrix2Xd seeds(2, 3);
  seeds << 0.5, 9.5, 500,  //
      0.5, 0.5, 500;
  const auto found = mean_shift(points, seeds, 2.0);
  CHECK(found.sizes() == std::vector<index_t>{40, 40});
  CHECK(found.labels().size() == 80);
  const auto one = mean_shift(points, seeds.leftCols(1), 2.0);
  CHECK(one.sizes() == std::vector<index_t>{80});
  CHECK(mean_shift(points, seeds.rightCols(1), 2.0).unlabeled() == 80);
}

TEST_CASE("mean shift of nothing, one point, equal points, NaN, and a limit") {
  const Eigen::Matrix2Xf nothing(2, 0);
  CHECK(mean_shift(nothing, 1).empty());
  const Eigen::Matrix2Xf one = Eigen::Matrix2Xf::Constant(2, 1, 3.0f);
  CHECK(mean_shift(one, 1).modes.col(0) == Eigen::Vector2f{3, 3});
  Eigen::Matrix2Xf equal = Eigen::Matrix2Xf::Constant(2, 10, 3.0f);
  equal(0, 2) = test::nan<float>;
  const auto found = mean_shift(equal, 1);
  CHECK(found.sizes() == std::vector<index_t>{9});
  CHECK(found.unlabeled() == 1);
  CHECK(found.densities[0] == doctest::Approx(9));
  const auto points = test::random_points<test::f2>(200);
  CHECK(mean_shift(points, 0.4, gaussian_kernel{}, {.max_iterations = 1}).unconverged > 0);
  CHECK_THROWS_AS((void)mean_shift(points, 0), invalid_input);
  CHECK_THROWS_AS((void)mean_shift(points, 1, gaussian_kernel{}, {.tolerance = -1}), invalid_input);
  CHECK_THROWS_AS((void)mean_shift(Eigen::MatrixXf{points}, Eigen::MatrixXf::Zero(3, 1).eval(), 1),
                  invalid_input);
}

TEST_CASE("far from the origin a mode is where it is near it") {
  const auto points = test::random_points<test::f2>(100, 3);
  const Eigen::Matrix2Xf far = (points.array() * 8).round() / 8 + 4096;
  const Eigen::Matrix2Xf near = far.array() - 4096;
  const auto a = mean_shift(near, 0.5, gaussian_kernel{}, {.tolerance = 1e-3});
  const auto b = mean_shift(far, 0.5, gaussian_kernel{}, {.tolerance = 1e-3});
  REQUIRE(a.size() == b.size());
  CHECK((b.modes.array() - 4096 - a.modes.array()).abs().maxCoeff() < 0.01f);
}

TEST_CASE("a kernel is tested on what its concept says") {
  CHECK(check_kernel(flat_kernel{}).empty());
  CHECK(check_kernel(epanechnikov_kernel{}).empty());
  CHECK(check_kernel(gaussian_kernel{}).empty());
  const double endless = test::infinity<double>;
  CHECK(check_kernel(custom_kernel{[](double u) { return 1 / (1 + u * u); }, endless}).empty());
  CHECK(check_kernel(custom_kernel{[](double u) { return u; }, endless}).size() == 2);
  CHECK(check_kernel(without_end{}).size() == 1);
}

static_assert(!Kernel<gaussian> && !Kernel<huber> && !Kernel<distance_weight>);
static_assert(!PairWeight<gaussian_kernel, double> && PairWeight<gaussian, double>);
static_assert(!SimilarityFunction<gaussian, float> && SimilarityFunction<bool (*)(float), float>);

TEST_CASE("a function is a kernel once it says how far it reaches") {
  const auto points = test::random_points<test::d2>(200, 3);
  const auto found =
      mean_shift(points, 0.4, custom_kernel{[](double u) { return std::exp(-u * u / 2); }, 4.0});
  CHECK(found == mean_shift(points, 0.4));
  CHECK_THROWS_AS((void)mean_shift(points, 0.4, custom_kernel{[](double) { return 1.0; }, 0.0}),
                  invalid_input);
  // Weights that are none would leave every point where it is, as if it were a mode.
  CHECK_THROWS_AS(
      (void)mean_shift(points, 0.4, custom_kernel{[](double u) { return 0.5 - u; }, 1.0}),
      invalid_input);
  CHECK(check_kernel(custom_kernel{[](double u) { return 1 / (1 + u * u); }, 3.0}).empty());
}
