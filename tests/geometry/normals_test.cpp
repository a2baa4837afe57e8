// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stop_token>
#include <type_traits>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import simulated_room;
import test_support;

using namespace cilantro;

namespace {

/// The angle between the lines along two directions, in radians.
template <class A, class B>
double angle_between(const A& a, const B& b) {
  const Eigen::VectorXd x = a.template cast<double>(), y = b.template cast<double>();
  return std::acos(std::clamp(std::abs(x.dot(y)) / (x.norm() * y.norm()), 0.0, 1.0));
}

/// Points in the hyperplane through the origin with this unit normal.
template <class T>
auto points_on_plane(index_t count, const point_vector<typename T::scalar, T::static_dimension>& n,
                     std::uint64_t seed) {
  auto points = test::random_points<T>(count, seed);
  points -= (n * (n.transpose() * points)).eval();
  return points;
}

template <class S>
struct surface_sample {
  Eigen::Matrix<S, 3, dynamic> points, normals;
};

template <class S>
surface_sample<S> sphere(index_t count, double radius) {
  surface_sample<S> sample{Eigen::Matrix<S, 3, dynamic>(3, count),
                           Eigen::Matrix<S, 3, dynamic>(3, count)};
  for (index_t i = 0; i < count; ++i) {  // Evenly, along a spiral with the golden angle.
    const double z = 1 - (2 * double(i) + 1) / double(count), r = std::sqrt(1 - z * z);
    const double turn = double(i) * std::numbers::pi * (3 - std::sqrt(5.0));
    sample.normals.col(i) << S(r * std::cos(turn)), S(r * std::sin(turn)), S(z);
    sample.points.col(i) = S(radius) * sample.normals.col(i);
  }
  return sample;
}

template <class S>
surface_sample<S> cylinder_sample(int around, int along, double radius) {
  const index_t count = index_t{around} * along;
  surface_sample<S> sample{Eigen::Matrix<S, 3, dynamic>(3, count),
                           Eigen::Matrix<S, 3, dynamic>(3, count)};
  const double step = 2 * std::numbers::pi / around;
  for (int a = 0; a < along; ++a)
    for (int t = 0; t < around; ++t) {
      const index_t i = index_t{a} * around + t;
      sample.normals.col(i) << S(std::cos(t * step)), S(std::sin(t * step)), S(0);
      sample.points.col(i) = S(radius) * sample.normals.col(i);
      sample.points(2, i) = S(a * step * radius);
    }
  return sample;
}

}  // namespace

TEST_CASE_TEMPLATE("the normals of a plane are the plane's, and its curvature is 0", T,
                   ALL_SPACES) {
  using S = typename T::scalar;
  auto normal = test::random_points<T>(1, 77).col(0).eval();
  normal.normalize();
  const auto points = points_on_plane<T>(400, normal, 1);
  const auto [normals, curvature] = estimate_normals(points, knn{12});
  for (index_t i = 0; i < 400; ++i) {
    CHECK(angle_between(normals.col(i), normal) < (sizeof(S) == 4 ? 1e-3 : 1e-7));
    CHECK(normals.col(i).norm() == doctest::Approx(1).epsilon(1e-6));
    CHECK(curvature[i] < 1e-6);
  }
}

TEST_CASE_TEMPLATE("the normals of a sphere point along its radius", S, float, double) {
  const auto [points, truth] = sphere<S>(4000, 2.5);
  const auto [normals, curvature] = estimate_normals(points, knn{9}, {.viewpoint = {{0, 0, 0}}});
  for (index_t i = 0; i < 4000; ++i) {
    CHECK(angle_between(normals.col(i), truth.col(i)) < 0.03);  // Half the angle between points.
    CHECK(normals.col(i).dot(truth.col(i)) < 0);  // Towards the viewpoint in the middle.
  }
}

TEST_CASE_TEMPLATE("the normals of a cylinder are exact where neighborhoods are symmetric", S,
                   float, double) {
  const int around = 60, along = 30;
  const auto [points, truth] = cylinder_sample<S>(around, along, 1);
  const auto [normals, curvature] = estimate_normals(points, radius{0.16});
  for (index_t i = 3 * around; i < index_t{around} * (along - 3); ++i)
    CHECK(angle_between(normals.col(i), truth.col(i)) < (sizeof(S) == 4 ? 2e-3 : 1e-7));
}

TEST_CASE_TEMPLATE("normals and curvatures are those of an eigen decomposition by brute force", T,
                   ALL_SPACES) {
  using S = typename T::scalar;
  const auto points = test::random_points<T>(300, 3);
  const brute_force_searcher searcher{points};
  for (const neighborhood_spec spec :
       {neighborhood_spec{knn{15}}, {radius{0.9}}, {knn_in_radius{12, 0.8}}}) {
    const auto found = estimate_normals(points, spec);
    std::vector<neighbor<S>> near;
    for (index_t i = 0; i < points.cols(); ++i) {
      searcher.find(points.col(i), spec, near);
      if (std::ssize(near) <= T::dimension) continue;
      Eigen::MatrixXd members(T::dimension, std::ssize(near));
      for (index_t j = 0; j < std::ssize(near); ++j)
        members.col(j) = points.col(near[std::size_t(j)].index).template cast<double>();
      members.colwise() -= members.rowwise().mean().eval();
      const auto [values, vectors, converged] =
          decompose_symmetric<dynamic>(members * members.transpose());
      // An eigenvector is as good as its eigenvalue is apart from the next.
      const double gap = (values[1] - values[0]) / values[values.size() - 1];
      const double eps = sizeof(S) == 4 ? 1e-6 : 1e-13;
      CHECK(double(found.curvature[i]) ==
            doctest::Approx(values[0] / values.sum()).epsilon(100 * eps));
      // The arc cosine of a number near 1 has half the digits.
      if (gap > 1e-3)
        CHECK(angle_between(found.normals.col(i), vectors.col(0)) < std::sqrt(eps) + eps / gap);
    }
  }
}

TEST_CASE_TEMPLATE("neighborhoods found by another searcher give the same normals", T, ALL_SPACES) {
  auto points = test::random_points<T>(300, 4);
  points(0, 5) = test::nan<typename T::scalar>;
  const brute_force_searcher searcher{points};
  const auto direct = estimate_normals(points, knn{10});
  const auto found = estimate_normals(points, find_neighborhoods(searcher, points, knn{10}));
  CHECK(test::same_bits(found.normals, direct.normals));
  CHECK(test::same_bits(found.curvature, direct.curvature));

  // Within a radius they are added up in no particular order, which rounding in double is all of.
  using S = typename T::scalar;
  const auto by_radius = estimate_normals(points, radius{0.3});
  const auto ascending =
      estimate_normals(points, find_neighborhoods(searcher, points, radius{0.3}));
  for (index_t i = 0; i < points.cols(); ++i) {
    const auto a = by_radius.normals.col(i), b = ascending.normals.col(i);
    CHECK((a.isZero(0) == b.isZero(0)));
    CHECK((a - b).norm() <= (std::is_same_v<S, float> ? 1e-5 : 1e-10));
  }
}

TEST_CASE_TEMPLATE("normals have the same bits for any number of threads", T, ALL_SPACES) {
  const auto points = test::random_points<T>(3000, 5);
  for (const neighborhood_spec& spec :
       {neighborhood_spec{knn{10}}, neighborhood_spec{radius{0.2}}}) {
    const auto one = estimate_normals(points, spec, {.threads = 1});
    for (const int threads : {2, 5}) {
      const auto many = estimate_normals(points, spec, {.threads = threads});
      CHECK(test::same_bits(many.normals, one.normals));
      CHECK(test::same_bits(many.curvature, one.curvature));
    }
    for (const auto target : test::available_targets()) {
      const test::using_target use{target};
      CHECK(test::same_bits(estimate_normals(points, spec).normals, one.normals));
    }
  }
}

TEST_CASE_TEMPLATE("normals do not depend on scale, nor on a far origin beyond rounding", S, float,
                   double) {
  const auto sample = sphere<S>(1000, 1);
  const auto near = estimate_normals(sample.points, knn{9});
  for (const S scale : {S(1e-12), S(1e12)}) {
    const auto scaled = estimate_normals((sample.points * scale).eval(), knn{9});
    CHECK(scaled.undetermined() == 0);
    CHECK((scaled.normals - near.normals).cwiseAbs().maxCoeff() < 1e-3);
  }
  if constexpr (sizeof(S) == 8) {
    auto far = sample.points;
    far.array() += 1e6;
    CHECK((estimate_normals(far, knn{9}).normals - near.normals).cwiseAbs().maxCoeff() < 1e-6);
  }
}

TEST_CASE_TEMPLATE("neighbors on a line, equal ones, or too few of them determine no normal", T,
                   ALL_SPACES) {
  using S = typename T::scalar;
  const auto expect_undetermined = [](const auto& points, const neighborhood_spec& spec) {
    const auto found = estimate_normals(points, spec);
    CHECK(found.undetermined() == points.cols());
    CHECK(found.normals.isZero(0));
    CHECK(found.curvature.isZero(0));
  };
  point_matrix<S, T::static_dimension> equal =
      point_matrix<S, T::static_dimension>::Constant(T::dimension, 20, S(0.3));
  expect_undetermined(equal, knn{10});
  if (T::dimension > 2) {
    auto line = equal;
    const auto direction = test::random_points<T>(1, 6).col(0).eval();
    for (index_t i = 0; i < 20; ++i) line.col(i) += S(i) * direction;
    expect_undetermined(line, knn{10});
  }
  const auto points = test::random_points<T>(20, 7);
  CHECK_THROWS_AS((void)estimate_normals(points, knn{T::dimension - 1}), invalid_input);
  CHECK_THROWS_AS((void)estimate_normals(points, knn_in_radius{T::dimension - 1, 1}),
                  invalid_input);
  expect_undetermined(points, radius{0});
  expect_undetermined(points.leftCols(1).eval(), knn{10});
  CHECK(estimate_normals(points.leftCols(0).eval(), knn{10}).normals.cols() == 0);
}

TEST_CASE_TEMPLATE("a point that is not finite gets no normal and disturbs no other", T,
                   ALL_SPACES) {
  auto points = test::random_points<T>(200, 8);
  const auto without = estimate_normals(points.rightCols(198).eval(), knn{10});
  points(0, 0) = test::nan<typename T::scalar>;
  points(1, 1) = test::infinity<typename T::scalar>;
  const auto found = estimate_normals(points, knn{10});
  CHECK(found.undetermined() == 2);
  CHECK(found.normals.leftCols(2).isZero(0));
  CHECK(test::same_bits(found.normals.rightCols(198), without.normals));
}

TEST_CASE_TEMPLATE("normals are turned to a viewpoint, or to reference normals", T, ALL_SPACES) {
  const auto points = test::random_points<T>(200, 9);
  const auto eye = test::random_points<T>(1, 10, 3, 4).col(0).eval();
  auto [normals, curvature] = estimate_normals(points, knn{10}, {.viewpoint = eye});
  for (index_t i = 0; i < 200; ++i) CHECK(normals.col(i).dot(eye - points.col(i)) >= 0);

  const auto reference = test::random_points<T>(200, 11);
  auto turned = normals;
  orient_to_reference(turned, reference);
  for (index_t i = 0; i < 200; ++i) CHECK(turned.col(i).dot(reference.col(i)) >= 0);
  orient_to_viewpoint(turned, points, eye);
  CHECK(test::same_bits(turned, normals));
}

TEST_CASE("without a viewpoint the largest component of each normal is positive") {
  const auto [normals, curvature] = estimate_normals(sphere<double>(500, 1).points, knn{9});
  for (index_t i = 0; i < normals.cols(); ++i) {
    index_t largest;
    normals.col(i).cwiseAbs().maxCoeff(&largest);
    CHECK(normals(largest, i) > 0);
  }
}

TEST_CASE("what does not fit the points is refused") {
  const auto points = test::random_points<test::f3>(20);
  CHECK_THROWS_AS((void)estimate_normals(points, knn{5}, {.viewpoint = {{0, 0}}}), invalid_input);
  CHECK_THROWS_AS(
      (void)estimate_normals(points, knn{5}, {.viewpoint = {{0, 0, test::nan<double>}}}),
      invalid_input);
  CHECK_THROWS_AS((void)estimate_normals(points, knn{5}, {.threads = -1}), invalid_input);
  CHECK_THROWS_AS((void)estimate_normals(points, neighborhoods<float>{}), invalid_input);
  const neighborhoods<float> elsewhere{{0, 1}, {7}, {0}};
  CHECK_THROWS_AS((void)estimate_normals(points.leftCols(1), elsewhere), invalid_input);
  Eigen::Matrix3Xf fewer = points.leftCols(3);
  CHECK_THROWS_AS(orient_to_viewpoint(fewer, points, {0, 0, 0}), invalid_input);
  CHECK_THROWS_AS(orient_to_reference(fewer, points), invalid_input);
}

TEST_CASE("normals report their progress and can be stopped") {
  const auto points = test::random_points<test::f3>(5000);
  double last = 0;
  (void)estimate_normals(points, knn{5}, {.monitor = {.progress = [&](double d) { last = d; }}});
  CHECK(last == 1);
  std::stop_source stop;
  const task_monitor monitor{.progress = [&](double) { stop.request_stop(); },
                             .stop = stop.get_token()};
  CHECK_THROWS_AS((void)estimate_normals(points, knn{5}, {.threads = 1, .monitor = monitor}),
                  cancelled);
}

TEST_CASE("the normals of a simulated room are the room's, but at its edges") {
  const auto frame = simulate(3, {.width = 320, .height = 240});
  const auto eye = frame.camera.to_world.translation();
  const auto [normals, curvature] = estimate_normals(frame.points, knn{12}, {.viewpoint = eye});
  std::vector<double> angles;
  for (index_t i = 0; i < normals.cols(); ++i)
    angles.push_back(std::acos(std::clamp(normals.col(i).dot(frame.normals.col(i)), -1.0, 1.0)));
  std::ranges::sort(angles);
  // Planes are exact; balls and legs bend within a neighborhood; at an edge two surfaces meet.
  CHECK(angles[angles.size() / 2] < 1e-6);
  CHECK(angles[angles.size() * 9 / 10] < 0.05);
}
