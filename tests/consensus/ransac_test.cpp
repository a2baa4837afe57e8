// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <stop_token>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

/// Points near a hyperplane through `through`, and others anywhere around.
template <class Space>
auto plane_and_clutter(index_t on, index_t off, double noise, std::uint64_t seed) {
  using S = typename Space::scalar;
  auto points = test::random_points<Space>(on + off, seed);
  random_stream random{seed + 1};
  // x₀ = 0.3 x₁ + 0.2
  for (index_t i = 0; i < on; ++i)
    points(0, i) = S(0.3 * double(points(1, i)) + 0.2 + noise * random.uniform(-1, 1));
  return points;
}

template <class Space>
Eigen::VectorXd true_normal() {
  Eigen::VectorXd normal = Eigen::VectorXd::Zero(Space::dimension);
  normal[0] = 1;
  normal[1] = -0.3;
  return normal.normalized();
}

}  // namespace

TEST_CASE_TEMPLATE("a hyperplane is found among outliers, and its inliers are those of a recount",
                   T, ALL_SPACES) {
  const auto points = plane_and_clutter<T>(120, 80, 0.005, 7);
  const hyperplane_family planes{points};
  for (const auto by : {ransac_score::inliers, ransac_score::msac})
    for (const bool local : {true, false}) {
      const ransac_options options{.max_residual = 0.02,
                                   .score = by,
                                   .max_iterations = 20000,
                                   .local_optimization = local,
                                   .threads = 1};
      const auto found = ransac(planes, options);
      REQUIRE(found);
      CHECK(found->model.normal.dot(true_normal<T>()) > std::cos(0.01));
      CHECK(std::ssize(found->inliers) >= 120);
      index_list recount;
      double squares = 0;
      for (index_t i = 0; i < points.cols(); ++i) {
        const double r = std::abs(found->model.normal.dot(points.col(i).template cast<double>()) +
                                  found->model.offset);
        if (r > 0.02) continue;
        recount.push_back(std::int32_t(i));
        squares += r * r;
      }
      CHECK(found->inliers == recount);
      CHECK(found->rmse ==
            doctest::Approx(std::sqrt(squares / double(recount.size()))).epsilon(1e-3));
      for (const int threads : {2, 5}) {
        auto parallel = options;
        parallel.threads = threads;
        const auto again = ransac(planes, parallel);
        REQUIRE(again);
        CHECK(again->model.normal == found->model.normal);
        CHECK(again->iterations == found->iterations);
        CHECK(again->inliers == found->inliers);
      }
    }
}

TEST_CASE("a second search knows nothing of the first") {
  // An earlier search with a coarse limit must not leave its model for one with a fine limit.
  const auto points = plane_and_clutter<test::d3>(50, 100, 0.02, 3);
  const hyperplane_family planes{points};
  const auto fresh = ransac(planes, {.max_residual = 1e-3});
  const auto coarse = ransac(planes, {.max_residual = 0.5});
  const auto second = ransac(planes, {.max_residual = 1e-3});
  REQUIRE((fresh && coarse && second));
  CHECK(coarse->inliers.size() > fresh->inliers.size());
  CHECK(second->inliers == fresh->inliers);
  CHECK(second->model.normal == fresh->model.normal);
  for (const index_t i : second->inliers)
    CHECK(std::abs(second->model.signed_distance(points.col(i))) <= 1e-3);
}

TEST_CASE("the search ends once the confidence is reached, and not before") {
  const auto points = plane_and_clutter<test::d3>(500, 500, 0.001, 1);
  const hyperplane_family planes{points};
  const auto iterations = [&](double confidence) {
    const auto found =
        ransac(planes, {.max_residual = 0.005, .confidence = confidence, .max_iterations = 500});
    REQUIRE(found);
    return found->iterations;
  };
  // A share of 0.505 gives log(1 − p) / log(1 − 0.505³) samples, 50 for 0.999.
  CHECK(iterations(0.999) >= 45);
  CHECK(iterations(0.999) <= 51);
  CHECK(iterations(0.9) <= 20);
  CHECK(iterations(1) == 500);
}

TEST_CASE("a preview gives the same plane for a fraction of the work") {
  const auto points = plane_and_clutter<test::f3>(20000, 20000, 0.001, 9);
  const hyperplane_family planes{points};
  const auto plain = ransac(planes, {.max_residual = 0.005, .confidence = 1});
  const auto quick = ransac(planes, {.max_residual = 0.005, .confidence = 1, .preview = 500});
  REQUIRE((plain && quick));
  CHECK(quick->model.normal == plain->model.normal);
  CHECK(quick->inliers == plain->inliers);
}

TEST_CASE("several models are found one after another, each among the data that are left") {
  Eigen::Matrix2Xd points(2, 130);
  random_stream random{5};
  for (index_t i = 0; i < 130; ++i) {
    const double t = random.uniform(-1, 1);
    if (i < 60)
      points.col(i) << t, 0.5;
    else if (i < 100)
      points.col(i) << 0.25, t;
    else
      points.col(i) << random.uniform(-1, 1), random.uniform(-1, 1);
  }
  const ransac_options options{.max_residual = 1e-3, .min_inliers = 20};
  const auto found = sequential_ransac(hyperplane_family{points}, 5, options);
  REQUIRE(found.size() == 2);
  CHECK(found[0].model.normal.isApprox(Eigen::Vector2d{0, 1}, 1e-6));
  CHECK(found[1].model.normal.isApprox(Eigen::Vector2d{1, 0}, 1e-6));
  for (const index_t i : found[1].inliers) CHECK(!std::ranges::binary_search(found[0].inliers, i));
  CHECK(sequential_ransac(hyperplane_family{points}, 1, options).size() == 1);
  CHECK(sequential_ransac(hyperplane_family{points}, 0, options).empty());
}

TEST_CASE("no data, too few, singular samples only, and NaN have no model") {
  const Eigen::Matrix3Xf nothing(3, 0), two = Eigen::Matrix3Xf::Random(3, 2);
  const ransac_options options{.max_residual = 0.1};
  CHECK(!ransac(hyperplane_family{nothing}, options));
  CHECK(!ransac(hyperplane_family{two}, options));
  const Eigen::Matrix3Xf equal = Eigen::Matrix3Xf::Ones(3, 50);
  CHECK(!ransac(hyperplane_family{equal}, options));
  CHECK(!ransac(line_family{equal}, options));
  CHECK(!ransac(sphere_family{equal}, options));
  Eigen::Matrix3Xf collinear(3, 50);
  for (index_t i = 0; i < 50; ++i) collinear.col(i) = float(i) * Eigen::Vector3f{1, 2, 3};
  CHECK(!ransac(hyperplane_family{collinear}, options));
  CHECK(ransac(line_family{collinear}, options)->inliers.size() == 50);
  Eigen::Matrix3Xf bad = Eigen::Matrix3Xf::Constant(3, 50, test::nan<float>);
  CHECK(!ransac(hyperplane_family{bad}, options));
  // Some of them: they are never inliers.
  bad.leftCols(30) = plane_and_clutter<test::f3>(30, 0, 0, 2);
  const auto found = ransac(hyperplane_family{bad}, options);
  REQUIRE(found);
  CHECK(found->inliers.size() == 30);
  CHECK(!ransac(hyperplane_family{bad}, {.max_residual = 0.1, .min_inliers = 31}));
}

TEST_CASE("options that make no sense are refused, and the search can be stopped") {
  const auto points = test::random_points<test::d3>(20);
  const hyperplane_family planes{points};
  CHECK_THROWS_AS((void)ransac(planes, {.max_residual = 0}), invalid_input);
  CHECK_THROWS_AS((void)ransac(planes, {.max_residual = 1, .confidence = 0}), invalid_input);
  CHECK_THROWS_AS((void)ransac(planes, {.max_residual = 1, .max_iterations = -1}), invalid_input);
  CHECK_THROWS_AS((void)sequential_ransac(planes, -1, {.max_residual = 1}), invalid_input);
  CHECK(!ransac(planes, {.max_residual = 1, .max_iterations = 0}));
  std::stop_source stop;
  stop.request_stop();
  CHECK_THROWS_AS((void)ransac(planes, {.max_residual = 1, .monitor = {.stop = stop.get_token()}}),
                  cancelled);
  double last = 0;
  (void)ransac(planes, {.max_residual = 0.01, .monitor = {.progress = [&](double p) {
                                                CHECK(p >= last);
                                                last = p;
                                              }}});
  CHECK(last == 1);
}

TEST_CASE_TEMPLATE("every vector target finds the same planes, also among what is left", T,
                   test::f2, test::f3, test::d2, test::d3) {
  using S = typename T::scalar;
  auto points = plane_and_clutter<T>(3000, 2500, 0.005, 11);
  points(1, 40) = test::nan<S>;
  const hyperplane_family planes{points};
  for (const auto by : {ransac_score::inliers, ransac_score::msac}) {
    const ransac_options options{
        .max_residual = 0.02, .score = by, .confidence = 1, .max_iterations = 50};
    std::vector<double> scores;
    std::vector<index_list> inliers;
    for (const auto target : test::available_targets()) {
      CAPTURE(name_of(target));
      const test::using_target use{target};
      const auto found = sequential_ransac(planes, 3, options);
      REQUIRE(found.size() == 3);
      for (std::size_t m = 0; m < 3; ++m) {
        // The score is that of the residuals one by one.
        double score = 0;
        for (const index_t i : found[m].inliers) {
          const double r = planes.residual(found[m].model, i);
          score += by == ransac_score::msac ? 1 - r * r / (0.02 * 0.02) : 1;
        }
        CHECK(found[m].score == doctest::Approx(score).epsilon(1e-3));
        if (target == vector_target::baseline) {
          scores.push_back(found[m].score);
          inliers.push_back(found[m].inliers);
        }
        CHECK(found[m].score == scores[m]);
        CHECK(found[m].inliers == inliers[m]);
      }
    }
  }
}
