// SPDX-License-Identifier: MIT
//
// A robust kernel that starts wide: it arrives where the kernel alone stays.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "spaces.hpp"

import cilantro;
import registration_support;
import test_support;

using namespace cilantro;

namespace {

/// A surface of which a part has gone elsewhere, moved from where it belongs.
template <class Space>
struct displaced {
  point_cloud<typename Space::scalar, Space::static_dimension> source, target;
  test::rigid_of<Space> truth;

  displaced(double share, double angle, double shift, std::uint64_t seed = 1)
      : source{test::bumpy_surface<Space>(2000, 1)},
        target{test::bumpy_surface<Space>(2000, 1)},
        truth{test::random_rigid<Space>(seed, angle, shift)} {
    const auto gone = index_t(share * 2000);
    source.points.leftCols(gone).row(0).array() += typename Space::scalar(0.25);
    source = transform(source, truth.inverse());
  }
  [[nodiscard]] double error(const auto& found) const {
    return test::difference(found.transform, truth);
  }
};

const align_options narrow{.max_iterations = 100, .robust = geman_mcclure{0.01}};

align_options graduated(align_options options, double by = 100) {
  options.graduation = by;
  return options;
}

}  // namespace

TEST_CASE_TEMPLATE("from farther off, a graduated kernel arrives where the kernel alone stays",
                   Space, test::f3, test::d3, test::d2) {
  int plain = 0, wide = 0;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const displaced<Space> problem{0.4, 0.5, 0.5, seed};
    plain += problem.error(align(problem.source, problem.target, narrow)) < 0.01;
    const auto found = align(problem.source, problem.target, graduated(narrow));
    wide += problem.error(found) < 0.01;
    CHECK(found.iterations > 14);
  }
  MESSAGE(plain << " of 10, graduated " << wide);
  CHECK(wide >= 9);
  CHECK(plain <= 5);
}

TEST_CASE("it does not count as converged before the kernel is as narrow as given") {
  const auto target = test::bumpy_surface<test::d3>(500);
  const auto still = align(target, target, graduated(narrow));
  CHECK(still.converged());
  CHECK(still.iterations == 15);
  CHECK(align(target, target, narrow).iterations < 3);
  // Each scale starts wide again.
  auto scales = graduated(narrow);
  scales.scales = {{0.1, 1}, {0, 0.5}};
  CHECK(align(target, target, scales).iterations == 30);
}

TEST_CASE("the figures are those of the kernel as given") {
  const displaced<test::d3> problem{0.3, 0.1, 0.1};
  auto options = graduated(narrow);
  const auto found = align(problem.source, problem.target, options);
  const auto figures = evaluate(problem.source, problem.target, found.transform, options);
  CHECK(figures.residual == found.residual);
  CHECK(figures.rmse == found.rmse);
}

TEST_CASE("the same bits for one thread and four, and each call starts anew") {
  const displaced<test::f3> problem{0.3, 0.2, 0.2};
  auto options = graduated(narrow);
  options.threads = 1;
  const auto one = align(problem.source, problem.target, options);
  options.threads = 4;
  int seen = 0;
  options.observer = [&](const align_iteration& now) { CHECK(now.number == ++seen); };
  const auto four = align(problem.source, problem.target, options);
  CHECK(one.transform.matrix() == four.transform.matrix());
  CHECK(seen == four.iterations);
  seen = 0;
  CHECK(align(problem.source, problem.target, options).transform.matrix() ==
        one.transform.matrix());
}

TEST_CASE("a graduation of 1 changes nothing") {
  const displaced<test::d3> problem{0.3, 0.1, 0.1};
  const auto plain = align(problem.source, problem.target, narrow);
  const auto once = align(problem.source, problem.target, graduated(narrow, 1));
  CHECK(plain.transform.matrix() == once.transform.matrix());
  CHECK(plain.iterations == once.iterations);
}

TEST_CASE("every metric and an affine motion can be graduated") {
  const displaced<test::d3> problem{0.2, 0.1, 0.1};
  for (const auto& metric : std::vector<metric_choice>{
           point_to_plane{}, point_to_point{}, symmetric{}, generalized_icp{},
           combined_metric{weighted_term{point_to_point{}, 0.1},
                           weighted_term{point_to_plane{}, 0.9}}}) {
    auto options = graduated(narrow, 20);
    options.metric = metric;
    CHECK(problem.error(align(problem.source, problem.target, options)) < 0.05);
  }
  CHECK(align<affine_motion>(problem.source, problem.target, graduated(narrow, 20)).pairs > 0);
}

TEST_CASE("a graduation that makes no sense gets a sentence") {
  const auto target = test::bumpy_surface<test::d3>(50);
  const auto refuse = [&](const align_options& options) {
    CHECK_THROWS_AS((void)align(target, target, options), invalid_input);
  };
  refuse({.graduation = 10});
  for (const double by : {0.5, 0.0, -1.0, test::nan<double>, test::infinity<double>})
    refuse({.robust = huber{0.1}, .graduation = by});
  refuse({.max_iterations = 14, .robust = huber{0.1}, .graduation = 100});
  CHECK(align(target, target, {.max_iterations = 15, .robust = huber{0.1}, .graduation = 100})
            .converged());
  CHECK_THROWS_AS((void)align(target, target, point_to_plane{}, {.graduation = 10}), invalid_input);
  const nearest_neighbor_searcher searcher{target, target};
  const point_to_point_estimator estimator{target, target};
  CHECK_THROWS_AS((void)icp(searcher, estimator, {.max_iterations = 5, .min_iterations = 6}),
                  invalid_input);
  CHECK_THROWS_AS((void)icp(searcher, estimator, {.min_iterations = -1}), invalid_input);
  CHECK(icp(searcher, estimator, {.min_iterations = 7}).iterations == 7);
}

TEST_CASE("a motion with a scale is a motion of align, too") {
  const auto target = test::bumpy_surface<test::d3>(3000);
  auto source = target;
  const double scale = 1.1;
  source.points /= scale;
  const auto found =
      align<similarity_motion>(source, target, {.metric = point_to_point{}, .max_iterations = 300});
  CHECK(found.converged());
  CHECK(std::cbrt(determinant(Eigen::MatrixXd{found.transform.linear()})) ==
        doctest::Approx(scale).epsilon(1e-3));
}
