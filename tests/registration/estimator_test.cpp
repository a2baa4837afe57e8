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
  const Transform back = test::inverse(truth);
  transform_points(back, target.points, source.points);
  transform_normals(back, target.normals, source.normals);
  const known_pairs_searcher searcher{source, target, test::same_indices<S>(300)};
  const auto estimator = make_estimator(target, source);
  const auto found = icp(searcher, estimator, estimator.identity(), {.tolerance = 1e-10});
  CHECK(test::difference(found.transform, truth) < rounding<T>());
  CHECK(found.undetermined == 0);
  CHECK(found.rmse < rounding<T>());
  CHECK(found.pairs == 300);
  CHECK(found.overlap == 1);
}

/// A solver from outside: every direction a little less than the equations say.
struct damped_solver {
  double damping;
  normal_solution operator()(const normal_equations& equations) const {
    normal_equations damped = equations;
    damped.information += damping * equations.motion;
    auto solution = truncated_solver{}(damped);
    solution.eigenvalues.array() -= damping;
    return solution;
  }
};

}  // namespace

TEST_CASE("a solver from outside takes the place of the shipped one") {
  check_exactness<test::d3>(
      test::random_rigid<test::d3>(3, 0.2, 0.3), [](const auto& t, const auto& s) {
        return least_squares_estimator{s, t, point_to_plane{}, rigid_motion{}, damped_solver{1e-4}};
      });
}

TEST_CASE("residuals of several terms are the same for any number of threads") {
  const auto target = test::bumpy_surface<test::d3>(5000),
             source = test::bumpy_surface<test::d3>(5000, 3);
  const combined_metric metric{weighted_term{point_to_point{}, 0.1}, symmetric{}};
  const auto pairs = test::same_indices<double>(5000);
  const auto residuals_on = [&](int threads) {
    return least_squares_estimator{
        source, target, metric, rigid_motion{}, truncated_solver{}, {.threads = threads}}
        .residuals(Eigen::Isometry3d::Identity(), pairs);
  };
  const Eigen::VectorXd one = residuals_on(1);
  CHECK(one == residuals_on(2));
  CHECK(one == residuals_on(5));
  const Eigen::Vector3d difference = source.points.col(7) - target.points.col(7);
  double along = 0;
  symmetric{}(matched_pair<3>{source.points.col(7), target.points.col(7), source.normals.col(7),
                              target.normals.col(7), 7, 7},
              [&](double value, const auto&...) { along = value; });
  CHECK(one[7] == doctest::Approx(std::sqrt(difference.squaredNorm() + along * along)));
}

TEST_CASE_TEMPLATE("the closed form finds a rigid motion to rounding", T, test::f2, test::f3,
                   test::f5, test::fx, test::d2, test::d3, test::d5, test::dx) {
  for (std::uint64_t seed = 0; seed < 10; ++seed)
    check_exactness<T>(test::random_rigid<T>(seed, 3, 2),
                       [](const auto& t, const auto& s) { return point_to_point_estimator{s, t}; });
}

TEST_CASE_TEMPLATE("the closed form finds an affine map to rounding", T, test::f2, test::f3,
                   test::f5, test::fx, test::d2, test::d3, test::d5, test::dx) {
  for (std::uint64_t seed = 0; seed < 10; ++seed)
    check_exactness<T>(test::random_affine<T>(seed, 0.2, 2), [](const auto& t, const auto& s) {
      return point_to_point_estimator{s, t, affine_motion{}};
    });
}

TEST_CASE_TEMPLATE("Gauss–Newton finds a rigid motion to rounding with every metric", T, test::f2,
                   test::f3, test::f5, test::fx, test::d2, test::d3, test::d5, test::dx) {
  const auto truth = test::random_rigid<T>(3, 0.3, 0.5);
  const auto check = [&](const auto& metric) {
    check_exactness<T>(
        truth, [&](const auto& t, const auto& s) { return least_squares_estimator{s, t, metric}; });
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
      return least_squares_estimator{s, t, metric, affine_motion{}};
    });
  };
  check(point_to_point{});
  check(combined_metric{weighted_term{point_to_point{}, 0.1}, point_to_plane{}});
}

TEST_CASE(
    "information is the sum of what the residuals see, of every metric, and its shares end at 1") {
  // Far from the answer, where the curvature of the cost is another thing.
  const auto target = test::random_points<test::d3>(400, 2);
  const Eigen::Matrix3Xd source = 0.5 * target;
  const auto pairs = test::same_indices<double>(400);
  Eigen::MatrixXd truth = Eigen::MatrixXd::Zero(6, 6);
  for (index_t i = 0; i < 400; ++i) {
    Eigen::Matrix<double, 3, 6> row;  // Of the velocity w × y + t.
    const Eigen::Vector3d y = source.col(i);
    row << 0, y[2], -y[1], 1, 0, 0, -y[2], 0, y[0], 0, 1, 0, y[1], -y[0], 0, 0, 0, 1;
    truth += row.transpose() * row;
  }
  const auto here = Eigen::Isometry3d::Identity();
  const auto check = [&](const alignment_fit& fit) {
    CHECK((fit.information - truth).norm() < 1e-9 * truth.norm());
    CHECK(fit.eigenvalues.maxCoeff() <= 1);
  };
  check(point_to_point_estimator{source, target}.estimate(here, pairs).fit);
  check(least_squares_estimator{source, target, point_to_point{}}.estimate(here, pairs).fit);
}

TEST_CASE("pairs of other points than the estimator's are refused") {
  const auto target = test::bumpy_surface<test::d3>(300),
             source = test::bumpy_surface<test::d3>(200, 2);
  const auto few = select(target, [](index_t i) { return i < 10; });
  const nearest_neighbor_searcher searcher{source, target, {.max_distance = 0.5}};
  const auto start = Eigen::Isometry3d::Identity();
  CHECK_THROWS_AS((void)(icp(searcher, least_squares_estimator{source, few}, start)),
                  invalid_input);
  CHECK_THROWS_AS((void)(icp(searcher, point_to_point_estimator{source, few}, start)),
                  invalid_input);
  CHECK_THROWS_AS((void)(icp(searcher, point_to_point_estimator{few, target}, start)),
                  invalid_input);
  const correspondences<double> negative{{-1, 0, 0}};
  const point_to_point_estimator estimator{source, target};
  CHECK_THROWS_AS((void)estimator.estimate(start, negative), invalid_input);
}

namespace {

/// The shipped terms under other names, which no vector kernel knows.
struct own_plane {
  static constexpr bool needs_target_normals = true;
  template <int D, class Emit>
  void operator()(const matched_pair<D>& pair, const Emit& emit) const {
    point_to_plane{}(pair, emit);
  }
};
struct own_point {
  template <int D, class Emit>
  void operator()(const matched_pair<D>& pair, const Emit& emit) const {
    point_to_point{}(pair, emit);
  }
};

}  // namespace

TEST_CASE_TEMPLATE(
    "weights, robust kernels and sums of both terms are what they are without a vector kernel", T,
    test::f3, test::d3) {
  using S = typename T::scalar;
  auto target = test::bumpy_surface<T>(3000, 1);
  auto source = test::bumpy_surface<T>(2500, 2);
  source.points.col(7).setConstant(test::nan<S>);
  target.normals.col(3).setZero();
  target.normals.col(4).setConstant(test::nan<S>);
  const auto transform = test::random_rigid<T>(5, 0.1, 0.05);
  correspondences<S> pairs;
  nearest_neighbor_searcher{source, target}.find(transform, pairs);
  pairs.push_back({7, 1, S(0)});
  pairs.push_back({1, 3, S(0.5)});
  pairs.push_back({1, 4, S(0.5)});

  const auto check_same = [&](const auto& metric, const auto& own) {
    for (const int threads : {1, 3}) {
      const execution how{.threads = threads};
      const auto step =
          least_squares_estimator{source, target, metric, rigid_motion{}, truncated_solver{}, how}
              .estimate(transform, pairs);
      const auto slow =
          least_squares_estimator{source, target, own, rigid_motion{}, truncated_solver{}, how}
              .estimate(transform, pairs);
      CHECK(test::difference(step.transform, slow.transform) < 4 * rounding<T>());
      CHECK(step.fit.pairs == slow.fit.pairs);
      CHECK(step.fit.rmse == doctest::Approx(slow.fit.rmse));
      CHECK(step.fit.residual == doctest::Approx(slow.fit.residual));
      CHECK((step.fit.information - slow.fit.information).norm() <
            1e-9 * slow.fit.information.norm());
      CHECK(step.fit.undetermined == slow.fit.undetermined);
    }
  };
  const auto every_third = [](index_t s, index_t, double distance) {
    return s % 3 == 0 ? 0.0 : 1 / (1 + distance);
  };
  check_same(point_to_plane{}, own_plane{});
  check_same(point_to_point{}, own_point{});
  check_same(weighted_term{point_to_plane{}, 0.7}, weighted_term{own_plane{}, 0.7});
  check_same(weighted_term{point_to_plane{}, 1, every_third, huber{0.02}},
             weighted_term{own_plane{}, 1, every_third, huber{0.02}});
  check_same(weighted_term{point_to_point{}, 2, every_third, tukey{0.3}},
             weighted_term{own_point{}, 2, every_third, tukey{0.3}});
  check_same(combined_metric{point_to_plane{}, weighted_term{point_to_point{}, 0.1}},
             combined_metric{own_plane{}, weighted_term{own_point{}, 0.1}});
  check_same(combined_metric{weighted_term{point_to_point{}, 0.3, every_third, cauchy{0.1}},
                             weighted_term{point_to_plane{}, 1, unit_weight{}, huber{0.05}}},
             combined_metric{weighted_term{own_point{}, 0.3, every_third, cauchy{0.1}},
                             weighted_term{own_plane{}, 1, unit_weight{}, huber{0.05}}});
}
