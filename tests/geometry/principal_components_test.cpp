// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

TEST_CASE_TEMPLATE("axes are orthonormal, right-handed and descending, and rebuild the covariance",
                   T, ALL_SPACES) {
  using S = typename T::scalar;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    auto points = test::random_points<T>(50, seed);
    for (index_t d = 0; d < T::dimension; ++d) points.row(d) *= S(d + 1);
    points(0, 4) = test::nan<S>;
    const auto basis = *principal_components(points);
    CHECK(basis.count == 49);
    const S rounding = 100 * std::numeric_limits<S>::epsilon();
    CHECK((basis.axes.transpose() * basis.axes).isIdentity(rounding));
    CHECK(determinant(basis.axes.template cast<double>()) == doctest::Approx(1).epsilon(1e-5));
    for (index_t d = 1; d < T::dimension; ++d)
      CHECK(basis.eigenvalues[d] <= basis.eigenvalues[d - 1]);
    const auto moments = *mean_and_covariance(points);
    const Eigen::MatrixXd axes = basis.axes.template cast<double>();
    CHECK((axes * basis.eigenvalues.asDiagonal() * axes.transpose())
              .isApprox(moments.covariance, double(rounding)));
    CHECK(basis.mean == moments.mean);
    CHECK(double(basis.explained_variance().sum()) == doctest::Approx(1));
  }
}

TEST_CASE_TEMPLATE("points are projected on few axes and rebuilt, as well as these axes can", T,
                   ALL_SPACES) {
  using S = typename T::scalar;
  auto points = test::random_points<T>(60, 3);
  points.row(0) = points.row(1) * S(0.5);  // One dimension less than it looks.
  const auto basis = *principal_components(points);
  const index_t k = T::dimension - 1;
  const auto projected = basis.project(points, k);
  CHECK((projected.rows() == k && projected.cols() == 60));
  CHECK(basis.reconstruct(projected).isApprox(points, S(1e-5)));
  const auto one = basis.template project<1>(points);
  CHECK(one.row(0).isApprox(projected.row(0), S(1e-5)));
  // What is lost is the variance along the other axes.
  const double lost = double((basis.reconstruct(one) - points).squaredNorm()) / 59;
  CHECK(lost ==
        doctest::Approx(double(basis.eigenvalues.tail(T::dimension - 1).sum())).epsilon(1e-3));
}

TEST_CASE("known axes are found, of all points or of some, plainly or robustly") {
  Eigen::Matrix3Xd points = test::random_points<test::d3>(300, 5);
  points.row(1) *= 10;
  points.row(2) *= 0.1;
  points.col(7) << 1e3, 0, 1e3;
  const auto robust = *principal_components(points, minimum_covariance_determinant{});
  CHECK(std::abs(robust.axes(1, 0)) > 0.999);
  CHECK(std::abs(robust.axes(2, 2)) > 0.999);
  std::vector<int> without;
  for (int i = 0; i < 300; ++i)
    if (i != 7) without.push_back(i);
  const auto some = *principal_components(points, without);
  CHECK(std::abs(some.axes(1, 0)) > 0.999);
  const auto plain = *principal_components(points);
  CHECK(std::abs(plain.axes(1, 0)) < 0.5);
}

TEST_CASE("nothing, one point and mismatches have a documented result") {
  CHECK_FALSE(principal_components(Eigen::Matrix3Xd(3, 0)));
  const auto one = *principal_components(Eigen::Matrix3Xd::Ones(3, 1).eval());
  CHECK(one.eigenvalues.isZero(0));
  CHECK(one.explained_variance().isZero(0));
  CHECK(one.axes.determinant() == doctest::Approx(1));
  CHECK_THROWS_AS((void)one.project(Eigen::Matrix3Xd::Ones(3, 2).eval(), 4), invalid_input);
  CHECK_THROWS_AS((void)one.project(Eigen::MatrixXd::Ones(2, 2).eval(), 1), invalid_input);
  CHECK_THROWS_AS((void)one.reconstruct(Eigen::Matrix4Xd::Ones(4, 2).eval()), invalid_input);
  CHECK_THROWS_AS((void)principal_components(Eigen::Matrix3Xd::Ones(3, 2).eval(), std::vector{2}),
                  invalid_input);
}

TEST_CASE("axes and shares do not depend on the unit, as long as the type holds the coordinates") {
  auto points = test::random_points<test::f3>(500, 2);
  for (index_t d = 0; d < 3; ++d) points.row(d) *= float(3 - d);
  const auto truth = *principal_components(points);
  for (const float scale : {0x1p-80f, 0x1p80f}) {
    const auto found = *principal_components((scale * points).eval());
    CHECK((found.axes - truth.axes).norm() < 1e-5f);
    CHECK((found.explained_variance() - truth.explained_variance()).norm() < 1e-6);
  }
}
