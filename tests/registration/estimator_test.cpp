// SPDX-License-Identifier: MIT
//
// Estimators, given the right pairs: the transform is found to rounding.
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "spaces.hpp"

import cilantro;
import registration_support;
import test_support;

using namespace cilantro;

namespace {

template <class T>
double rounding() {
  return 100 * double(std::numeric_limits<typename T::scalar>::epsilon());
}

/// Moves the surface away by the inverse of `truth`, gives the right pairs, and looks what is
/// found.
template <class T, class Transform, class MakeEstimator>
void check_exactness(const Transform& truth, MakeEstimator make_estimator) {
  using S = typename T::scalar;
  const auto target = test::bumpy_surface<T>(300);
  auto source = target;
  const Transform back = truth.inverse();
  transform_points(back, target.points, source.points);
  transform_normals(back, target.normals, source.normals);
  const oracle_searcher searcher{target, source, test::same_indices<S>(300)};
  const auto estimator = make_estimator(target, source);
  const auto found = icp(searcher, estimator, estimator.identity(), {.tolerance = 1e-10});
  CHECK(test::difference(found.transform, truth) < rounding<T>());
  CHECK(found.undetermined == 0);
  CHECK(found.rmse < rounding<T>());
  CHECK(found.pairs == 300);
  CHECK(found.overlap == 1);
}

}  // namespace

TEST_CASE_TEMPLATE("the closed form finds a rigid motion to rounding", T, test::f2, test::f3,
                   test::f5, test::fx, test::d2, test::d3, test::d5, test::dx) {
  for (std::uint64_t seed = 0; seed < 10; ++seed)
    check_exactness<T>(test::random_rigid<T>(seed, 3, 2),
                       [](const auto& t, const auto& s) { return point_to_point_estimator{t, s}; });
}

TEST_CASE_TEMPLATE("the closed form finds an affine map to rounding", T, test::f2, test::f3,
                   test::f5, test::fx, test::d2, test::d3, test::d5, test::dx) {
  for (std::uint64_t seed = 0; seed < 10; ++seed)
    check_exactness<T>(test::random_affine<T>(seed, 0.2, 2), [](const auto& t, const auto& s) {
      return point_to_point_estimator{t, s, affine_motion{}};
    });
}

TEST_CASE_TEMPLATE("Gauss–Newton finds a rigid motion to rounding with every metric", T, test::f2,
                   test::f3, test::f5, test::fx, test::d2, test::d3, test::d5, test::dx) {
  const auto truth = test::random_rigid<T>(3, 0.3, 0.5);
  const auto check = [&](const auto& metric) {
    check_exactness<T>(
        truth, [&](const auto& t, const auto& s) { return least_squares_estimator{t, s, metric}; });
  };
  check(point_to_point{});
  check(point_to_plane{});
  check(symmetric{});
  check(generalized_icp{});
  check(combined_metric{weighted_term{point_to_point{}, 0.1}, point_to_plane{}});
  check(weighted_term{point_to_plane{}, 1, unit_weight{}, huber{0.1}});
}

TEST_CASE_TEMPLATE("Gauss–Newton finds an affine map to rounding", T, test::f2, test::f3, test::f5,
                   test::fx, test::d2, test::d3, test::d5, test::dx) {
  const auto truth = test::random_affine<T>(4, 0.1, 0.3);
  const auto check = [&](const auto& metric) {
    check_exactness<T>(truth, [&](const auto& t, const auto& s) {
      return least_squares_estimator{t, s, metric, affine_motion{}};
    });
  };
  check(point_to_point{});
  check(combined_metric{weighted_term{point_to_point{}, 0.1}, point_to_plane{}});
}
