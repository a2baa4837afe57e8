// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

index_list all_of_set(index_t n) {
  index_list indices;
  for (index_t i = 0; i < n; ++i) indices.push_back(std::int32_t(i));
  return indices;
}

template <class S>
Eigen::Matrix<S, 3, dynamic> on_cylinder(const Eigen::Vector3d& point, const Eigen::Vector3d& axis,
                                         double radius, index_t n, double noise,
                                         Eigen::Matrix<S, 3, dynamic>* normals = nullptr) {
  Eigen::Matrix<S, 3, dynamic> points(3, n);
  if (normals) normals->resize(3, n);
  random_stream random{4};
  const Eigen::Vector3d u = axis.unitOrthogonal(), v = axis.cross(u);
  for (index_t i = 0; i < n; ++i) {
    const double angle = random.uniform(0, 6.283), r = radius + noise * random.uniform(-1, 1);
    const Eigen::Vector3d out = std::cos(angle) * u + std::sin(angle) * v;
    points.col(i) = (point + random.uniform(-1, 1) * axis + r * out).template cast<S>();
    if (normals) normals->col(i) = out.cast<S>();
  }
  return points;
}

}  // namespace

TEST_CASE_TEMPLATE("each family keeps its contract on random data", T, ALL_SPACES) {
  using S = typename T::scalar;
  const double tolerance = sizeof(S) == 4 ? 2e-4 : 1e-9;
  auto points = test::random_points<T>(40, 5);
  points(0, 39) = test::nan<S>;
  CHECK(check_model_family(hyperplane_family{points}, tolerance) == std::vector<std::string>{});
  CHECK(check_model_family(line_family{points}, tolerance) == std::vector<std::string>{});
  // The smallest spheres of nearly flat samples are huge, and their rounding with them.
  CHECK(check_model_family(sphere_family{points, {.radius = {.max = 20}}}, 20 * tolerance) ==
        std::vector<std::string>{});
  const auto others = test::random_points<T>(40, 6);
  CHECK(check_model_family(affine_family(points, others), 100 * tolerance) ==
        std::vector<std::string>{});
  CHECK(check_model_family(rigid_family(points, others), tolerance, true) ==
        std::vector<std::string>{});
  CHECK(check_model_family(similarity_family(points, others), tolerance, true) ==
        std::vector<std::string>{});
}

TEST_CASE("a family that breaks its contract is told so") {
  struct model {
    double value;
  };
  struct crooked {
    using model_type = model;
    static index_t size() { return 10; }
    static index_t sample_size() { return 2; }
    static std::optional<model> fit(std::span<const std::int32_t> indices) {
      return model{double(indices.size())};
    }
    static double residual(const model&, index_t i) { return double(i) - 5; }
    static void score(std::span<const model>, index_t, index_t, const residual_scoring&,
                      std::span<data_score> sums) {
      sums[0].inliers += 1;
    }
  };
  static_assert(ModelFamily<crooked>);
  CHECK(check_model_family(crooked{}, 1e-9).size() == 4);
}

TEST_CASE_TEMPLATE("a line in any dimension is that of least squares", T, ALL_SPACES) {
  using S = typename T::scalar;
  const index_t d = T::dimension;
  auto points = test::random_points<T>(100, 3);
  const Eigen::VectorXd direction = Eigen::VectorXd::LinSpaced(d, 1, 2).normalized();
  random_stream random{1};
  for (index_t i = 0; i < 60; ++i)
    points.col(i) = (random.uniform(-1, 1) * direction).template cast<S>();
  const line_family lines{points};
  const auto found = ransac(lines, {.max_residual = 1e-3});
  REQUIRE(found);
  CHECK(found->inliers.size() >= 60);
  CHECK(found->model.direction.dot(direction) > 1 - 1e-6);
  CHECK(found->model.distance(Eigen::VectorXd::Zero(d).eval()) < 1e-4);
}

TEST_CASE_TEMPLATE("a sphere in any dimension is found, and fitted by its distances", T,
                   ALL_SPACES) {
  using S = typename T::scalar;
  auto points = test::random_points<T>(300, 3);
  const Eigen::VectorXd center = Eigen::VectorXd::LinSpaced(T::dimension, 0.1, 0.3);
  for (index_t i = 0; i < 200; ++i) {
    const Eigen::VectorXd out = points.col(i).template cast<double>().normalized();
    points.col(i) = (center + 0.6 * out).template cast<S>();
  }
  const auto found = ransac(sphere_family{points}, {.max_residual = 1e-3, .max_iterations = 5000});
  REQUIRE(found);
  CHECK(found->inliers.size() >= 200);
  CHECK((found->model.center - center).norm() < 1e-4);
  CHECK(found->model.radius == doctest::Approx(0.6).epsilon(1e-4));
  CHECK(!ransac(sphere_family{points, {.radius = {.min = 0.7, .max = 0.75}}},
                {.max_residual = 1e-3, .min_inliers = 100}));
  CHECK_THROWS_AS((void)sphere_family(points, {.radius = {.min = 2, .max = 1}}), invalid_input);
}

TEST_CASE("the least squares of a short arc are geometric, where algebra is biased") {
  Eigen::Matrix2Xd arc(2, 200);
  random_stream random{8};
  for (index_t i = 0; i < 200; ++i) {
    const double angle = 0.6 * double(i) / 199, r = 1 + 0.02 * random.uniform(-1, 1);
    arc.col(i) << r * std::cos(angle), r * std::sin(angle);
  }
  const auto fitted = sphere_family{arc}.fit(all_of_set(200));
  REQUIRE(fitted);
  // At the minimum the gradient of Σ (|p − c| − r)² is 0.
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
  double mean = 0;
  for (index_t i = 0; i < 200; ++i) {
    const Eigen::Vector2d out = arc.col(i) - fitted->center;
    gradient += (out.norm() - fitted->radius) * out.normalized();
    mean += out.norm() - fitted->radius;
  }
  CHECK(gradient.norm() < 1e-8);
  CHECK(std::abs(mean) < 1e-8);
}

TEST_CASE_TEMPLATE("a circle in space is found within its plane", S, float, double) {
  Eigen::Matrix<S, 3, dynamic> points = test::random_points<test::space<S, 3>>(300, 4);
  const Eigen::Vector3d normal = Eigen::Vector3d{1, 2, 2} / 3, center{0.1, 0.2, -0.1};
  const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
  for (index_t i = 0; i < 150; ++i) {
    const double angle = 0.05 * double(i);
    points.col(i) = (center + 0.5 * (std::cos(angle) * u + std::sin(angle) * v)).template cast<S>();
  }
  const circle_family circles{points};
  CHECK(check_model_family(circle_family{points, {.radius = {.max = 5}}},
                           sizeof(S) == 4 ? 1e-3 : 1e-9) == std::vector<std::string>{});
  const auto found = ransac(circles, {.max_residual = 2e-3});
  REQUIRE(found);
  CHECK(found->inliers.size() >= 150);
  CHECK((found->model.center - center).norm() < 1e-3);
  CHECK(std::abs(found->model.normal.dot(normal)) > 1 - 1e-5);
  CHECK(found->model.radius == doctest::Approx(0.5).epsilon(1e-3));
}

TEST_CASE_TEMPLATE("a cylinder is found by normals, and fitted by distances", S, float, double) {
  const Eigen::Vector3d point{0.3, -0.2, 0.1}, axis = Eigen::Vector3d{1, -1, 3}.normalized();
  Eigen::Matrix<S, 3, dynamic> normals;
  Eigen::Matrix<S, 3, dynamic> points = on_cylinder<S>(point, axis, 0.4, 400, 0.002, &normals);
  points.rightCols(150) = test::random_points<test::space<S, 3>>(150, 4);
  normals.rightCols(150) = test::random_points<test::space<S, 3>>(150, 5).colwise().normalized();
  const cylinder_family cylinders{points, normals};
  CHECK(check_model_family(cylinders, 1, true) == std::vector<std::string>{});
  const auto found = ransac(cylinders, {.max_residual = 0.01});
  REQUIRE(found);
  CHECK(found->inliers.size() >= 250);
  CHECK(std::abs(found->model.axis.direction.dot(axis)) > 1 - 1e-5);
  CHECK(found->model.radius == doctest::Approx(0.4).epsilon(0.01));
  CHECK(found->model.axis.distance(point) < 0.002);
  CHECK(!ransac(cylinder_family{points, normals, {.axis = direction_limit{{1, 0, 0}, 0.1}}},
                {.max_residual = 0.01, .min_inliers = 100}));
  CHECK_THROWS_AS((void)cylinder_family(points, normals.leftCols(3).eval().leftCols(3)),
                  invalid_input);
}

TEST_CASE("a plane within an angle of an axis is found where a larger one is not") {
  Eigen::Matrix3Xd points(3, 150);
  random_stream random{2};
  for (index_t i = 0; i < 150; ++i) {
    const double a = random.uniform(-1, 1), b = random.uniform(-1, 1);
    if (i < 100)
      points.col(i) << 0.5, a, b;  // A wall.
    else
      points.col(i) << a, b, 0.1 * a;  // A floor that leans a little.
  }
  const ransac_options options{.max_residual = 1e-3};
  CHECK(std::abs(ransac(hyperplane_family{points}, options)->model.normal.x()) > 0.99);
  const auto floor =
      ransac(hyperplane_family{points, {.normal = direction_limit{{0, 0, -1}, 0.2}}}, options);
  REQUIRE(floor);
  CHECK(floor->model.normal.z() > 0.99);
  CHECK(floor->inliers.size() >= 50);
  CHECK_THROWS_AS((void)hyperplane_family(points, {.normal = direction_limit{{0, 0}, 0.2}}),
                  invalid_input);
  CHECK_THROWS_AS((void)hyperplane_family(points, {.normal = direction_limit{{0, 0, 0}, 0.2}}),
                  invalid_input);
  CHECK_THROWS_AS((void)hyperplane_family(points, {.normal = direction_limit{{0, 0, 1}, -1}}),
                  invalid_input);
}

TEST_CASE_TEMPLATE("transforms are found from pairs of which half are wrong", T, ALL_SPACES) {
  using S = typename T::scalar;
  const index_t d = T::dimension;
  const auto source = test::random_points<T>(100, 3);
  auto target = test::random_points<T>(100, 4, -3, 3);
  random_stream random{9};
  Eigen::MatrixXd linear(d, d);
  for (index_t i = 0; i < d; ++i)
    for (index_t k = 0; k < d; ++k) linear(i, k) = random.uniform(-1, 1);
  Eigen::VectorXd shift(d);
  for (auto& x : shift) x = random.uniform(-1, 1);
  const auto check = [&](const Eigen::MatrixXd& a, auto family_of) {
    auto onto = target;
    for (index_t i = 0; i < 50; ++i)
      onto.col(i) = (a * source.col(i).template cast<double>() + shift).template cast<S>();
    const auto family = family_of(onto);
    const auto found = ransac(family, {.max_residual = 1e-3, .max_iterations = 20000});
    REQUIRE(found);
    CHECK(found->inliers == all_of_set(50));
    CHECK((found->model.linear().template cast<double>() - a).norm() < 1e-4);
    CHECK((found->model.translation().template cast<double>() - shift).norm() < 1e-4);
  };
  check(nearest_rotation(linear), [&](const auto& onto) { return rigid_family(source, onto); });
  check(0.7 * nearest_rotation(linear),
        [&](const auto& onto) { return similarity_family(source, onto); });
  check(linear + 2 * Eigen::MatrixXd::Identity(d, d),
        [&](const auto& onto) { return affine_family(source, onto); });
}

TEST_CASE("pairs may be named by correspondences, in any order and number") {
  const auto source = test::random_points<test::f3>(30);
  Eigen::Matrix3Xf target = source.rowwise().reverse();
  target.colwise() += Eigen::Vector3f{1, 2, 3};
  correspondences<float> pairs;
  for (std::int32_t i = 0; i < 30; ++i) pairs.push_back({i % 3 == 2 ? i : 29 - i, i, 0});
  const auto found = ransac(rigid_family(source, target, pairs), {.max_residual = 1e-3});
  REQUIRE(found);
  CHECK(found->inliers.size() == 20);
  CHECK((found->model.translation() - Eigen::Vector3f{1, 2, 3}).norm() < 1e-5f);
  CHECK(!ransac(rigid_family(source, target, correspondences<float>{}), {.max_residual = 1}));
  CHECK_THROWS_AS((void)rigid_family(source, target, correspondences<float>{{30, 0, 0}}),
                  invalid_input);
  CHECK_THROWS_AS((void)rigid_family(source.leftCols(4), target), invalid_input);
}

TEST_CASE("a reflection is no rigid transform, and flat points have one all the same") {
  Eigen::Matrix3Xd source = test::random_points<test::d3>(30);
  source.row(2).setZero();
  Eigen::Matrix3Xd target = source;
  target.row(0) *= -1;
  // In a plane a reflection is a half turn around an axis in it.
  const auto found = ransac(rigid_family(source, target), {.max_residual = 1e-6});
  REQUIRE(found);
  CHECK(found->inliers.size() == 30);
  CHECK(found->model.linear().determinant() == doctest::Approx(1));
  CHECK(!ransac(affine_family(source, target), {.max_residual = 1e-6}));
}

namespace {

/// How many of some fits are worse than the model that the points were made from.
template <class M>
int worse_than(const std::optional<M>& found, const M& truth, const auto& points) {
  const auto squares = [&](const M& model) {
    double sum = 0;
    for (index_t i = 0; i < points.cols(); ++i)
      sum += std::pow(model.signed_distance(points.col(i)), 2);
    return sum;
  };
  return !found || squares(*found) > 1.001 * squares(truth);
}

index_list first_indices(index_t n) {
  index_list all;
  for (index_t i = 0; i < n; ++i) all.push_back(std::int32_t(i));
  return all;
}

}  // namespace

TEST_CASE("a circle of least squares is never worse than the truth, on a short and noisy arc") {
  for (const index_t n : {20, 100})
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
      random_stream random{seed, 1};
      Eigen::Matrix2Xd points(2, n);
      for (index_t i = 0; i < n; ++i) {
        const double t = random.uniform(0, 1), r = 1 + 0.1 * random.normal();
        points.col(i) << r * std::cos(t), r * std::sin(t);
      }
      CAPTURE(seed);
      CHECK(worse_than(sphere_family{points}.fit(first_indices(n)), {Eigen::Vector2d::Zero(), 1},
                       points) == 0);
    }
}

TEST_CASE("a cylinder of least squares is never worse than the truth, whatever its normals") {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    random_stream random{seed, 2};
    Eigen::Matrix3Xd points(3, 5), normals(3, 5);
    for (index_t i = 0; i < 5; ++i) {
      const double t = random.uniform(0, 6.283185307179586);
      const Eigen::Vector3d out{std::cos(t), std::sin(t), 0},
          tilt{random.normal(), random.normal(), random.normal()};
      points.col(i) =
          (1 + 0.01 * random.normal()) * out + Eigen::Vector3d{0, 0, random.uniform(-2, 2)};
      normals.col(i) = (out + 0.1 * tilt).normalized();
    }
    CAPTURE(seed);
    CHECK(worse_than(cylinder_family{points, normals}.fit(first_indices(5)),
                     {{Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ()}, 1}, points) == 0);
  }
}

TEST_CASE("degrees are no angles") {
  const auto points = test::random_points<test::d3>(20);
  const Eigen::Matrix3Xd normals = points.colwise().normalized();
  CHECK_THROWS_AS((hyperplane_family{points, {.normal = direction_limit{{0, 0, 1}, 10}}}),
                  invalid_input);
  CHECK_THROWS_AS((similar_normals{normals, 10.0}), invalid_input);
  CHECK_THROWS_AS((similar_normals{normals, -0.1}), invalid_input);
}
