// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

template <class T>
auto random_directions(index_t count, std::uint64_t seed) {
  auto all = test::random_points<T>(count, seed);
  for (auto column : all.colwise()) column.normalize();
  return all;
}

}  // namespace

static_assert(SimilarityFunction<decltype([](index_t, index_t, float) { return true; }), float>);
static_assert(SimilarityFunction<decltype([](float d) { return d < 1; }), float>);
static_assert(!SimilarityFunction<decltype([](index_t) { return 3.5; }), std::vector<int>>);
static_assert(PairWeight<huber, float> && PairWeight<geman_mcclure, double>);
static_assert(!PairWeight<int, float>);

// The first cilantro took an arc cosine of 1.0000001 and found 194 of 1000 identical pairs unlike.
TEST_CASE_TEMPLATE("the angle between a vector and itself is 0, always", T, ALL_SPACES) {
  const auto normals = random_directions<T>(1000, 1);
  const similar_normals same{normals, 0};
  for (index_t i = 0; i < 1000; ++i) {
    CHECK(angle_between(normals.col(i), normals.col(i)) == 0);
    CHECK(angle_between(normals.col(i), normals.col(i) * 4) == 0);
    CHECK(same(i, i, 0));
  }
}

TEST_CASE_TEMPLATE("angles are accurate from the smallest to half a turn", T, test::f2, test::d2) {
  using S = typename T::scalar;
  for (const double angle : {1e-30, 1e-7, 0.3, 1.5, 3.0, 3.1415}) {
    const Eigen::Vector2<S> a{2, 0};
    const Eigen::Vector2<S> b{S(std::cos(angle)), S(std::sin(angle))};
    CHECK(double(angle_between(a, b)) ==
          doctest::Approx(angle).epsilon(4 * double(std::numeric_limits<S>::epsilon())));
  }
  CHECK(std::isnan(angle_between(Eigen::Vector2<S>{0, 0}, Eigen::Vector2<S>{0, 1})));
}

TEST_CASE_TEMPLATE("normals are similar up to an angle, with or without regard to sign", T,
                   ALL_SPACES) {
  const auto normals = random_directions<T>(60, 2);
  for (const double limit : {0.3, 1.2, 2.5, std::numbers::pi}) {
    const similar_normals similar{normals, limit};
    const similar_normals unsigned_similar{normals, limit, {.ignore_sign = true}};
    for (index_t i = 0; i < 60; ++i)
      for (index_t j = 0; j < 60; ++j) {
        const double angle = double(angle_between(normals.col(i), normals.col(j)));
        CHECK(similar(i, j, 0) == (angle <= limit));
        CHECK(unsigned_similar(i, j, 0) == (std::min(angle, std::numbers::pi - angle) <= limit));
      }
  }
}

TEST_CASE("unknown normals are similar to nothing") {
  Eigen::Matrix3Xf normals = Eigen::Matrix3Xf::Zero(3, 3);
  normals.col(1) << 0, 0, 1;
  normals.col(2).setConstant(test::nan<float>);
  const similar_normals similar{normals, 3.14};
  CHECK(similar(1, 1, 0));
  for (const index_t i : {0, 2})
    for (const index_t j : {0, 1, 2}) CHECK_FALSE(similar(i, j, 0));
}

TEST_CASE("points, colors, and any conjunction are compared, also between two sets") {
  Eigen::Matrix2Xd target(2, 2), source(2, 1);
  target << 0, 3, 0, 4;
  source << 0, 0;
  const close_points close{target, source, 5};
  CHECK(close(0, 0, 0));
  CHECK(close(1, 0, 0));
  const close_points closer{target, source, 4.99};
  CHECK_FALSE(closer(1, 0, 0));
  CHECK_FALSE(close_points{target, 4.99}(1, 0, 0));

  Eigen::Matrix3Xf colors(3, 2);
  colors << 0, 1, 0, 1, 0, 1;
  CHECK(similar_colors{colors, 1.7321}(0, 1, 0.0));
  CHECK_FALSE(similar_colors{colors, 1.73}(0, 1, 0.0));

  const all_similar both{close, similar_colors{colors, 1.7321},
                         [](double distance) { return distance < 7; }};
  CHECK(both(1, 0, 6.0));
  CHECK_FALSE(both(1, 0, 7.0));
  CHECK_THROWS_AS((close_points{target, -1}), invalid_input);
  CHECK_THROWS_AS((similar_normals{target, test::nan<double>}), invalid_input);
  const Eigen::MatrixXd flat(1, 2), deep(3, 2);
  CHECK_THROWS_AS((close_points{flat, deep, 1}), invalid_input);
}

TEST_CASE_TEMPLATE("weights are those of their formulas", S, float, double) {
  const auto is = [](S weight, double expected) {
    CHECK(double(weight) == doctest::Approx(expected).epsilon(1e-6));
  };
  is(unit_weight{}(S(3)), 1);
  is(distance_weight{}(S(3)), 3);
  is(gaussian{.sigma = 2}(S(2)), std::exp(-0.5));
  is(gaussian{.sigma = 2}(S(0)), 1);
  is(huber{.scale = 2}(S(2)), 1);
  is(huber{.scale = 2}(S(-8)), 0.25);
  is(tukey{.scale = 2}(S(1)), 0.5625);
  is(tukey{.scale = 2}(S(2)), 0);
  is(tukey{.scale = 2}(S(-5)), 0);
  is(cauchy{.scale = 2}(S(4)), 0.2);
  is(geman_mcclure{.scale = 2}(S(-4)), 0.04);
  for (const S far : {S(1e30), test::infinity<S>}) {
    is(huber{.scale = 1}(far), 0);
    is(tukey{.scale = 1}(far), 0);
    is(cauchy{.scale = 1}(far), 0);
    is(geman_mcclure{.scale = 1}(far), 0);
    is(gaussian{.sigma = 1}(far), 0);
  }
}

TEST_CASE("robust weights are derivatives of their losses over the residual") {
  const auto expect = [](auto weight, auto loss) {
    for (const double r : {0.01, 0.4, 0.9, 1.7, 3.0, 9.0}) {
      const double h = 1e-6;
      CHECK(weight(r) == doctest::Approx((loss(r + h) - loss(r - h)) / (2 * h * r)).epsilon(1e-4));
    }
  };
  const double c = 1.5;
  expect(huber{c}, [&](double r) { return r <= c ? r * r / 2 : c * (r - c / 2); });
  expect(tukey{c}, [&](double r) {
    return r <= c ? c * c / 6 * (1 - std::pow(1 - r * r / (c * c), 3)) : c * c / 6;
  });
  expect(cauchy{c}, [&](double r) { return c * c / 2 * std::log1p(r * r / (c * c)); });
  expect(geman_mcclure{c}, [&](double r) { return r * r / 2 / (1 + r * r / (c * c)); });
}

TEST_CASE("scales that are not positive are refused") {
  CHECK_THROWS_AS((void)gaussian{.sigma = 0}, invalid_input);
  CHECK_THROWS_AS((void)huber{.scale = -1}, invalid_input);
  CHECK_THROWS_AS((void)tukey{.scale = test::nan<double>}, invalid_input);
  CHECK_THROWS_AS((void)cauchy{.scale = test::infinity<double>}, invalid_input);
}
