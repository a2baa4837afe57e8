// SPDX-License-Identifier: MIT
#include <cmath>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

template <class T>
using affine = Eigen::Transform<typename T::scalar, T::static_dimension, Eigen::Affine>;

/// Fixed dimensions only: Eigen has no transform of a run-time one.
template <class T>
affine<T> some_affine() {
  affine<T> transform;
  transform.linear() = test::random_points<T>(T::dimension, 42).eval();
  transform.linear().diagonal().array() += 2;
  transform.translation() = test::random_points<T>(1, 43);
  transform.makeAffine();
  return transform;
}

}  // namespace

TEST_CASE_TEMPLATE("points are moved as the transform says", T, test::f2, test::f3, test::f5,
                   test::d2, test::d3, test::d5) {
  const auto transform = some_affine<T>();
  const auto points = test::random_points<T>(50);
  const auto moved = transform_points(transform, points);
  for (index_t i = 0; i < 50; ++i) CHECK((moved.col(i) - transform * points.col(i)).norm() < 1e-5);
}

// The first cilantro moved them twice: x became 3 instead of 2.
TEST_CASE("points and normals that are moved in place are moved once") {
  Eigen::Isometry3f shift = Eigen::Isometry3f::Identity();
  shift.translation() = Eigen::Vector3f{1, 0, 0};
  Eigen::Matrix3Xf points = Eigen::Vector3f{1, 0, 0}, normals = Eigen::Vector3f{0, 1, 0};
  transform_points(shift, points, points);
  CHECK(points == Eigen::Vector3f{2, 0, 0});

  const Eigen::Affine3f quarter{Eigen::AngleAxisf{std::acos(0.0f), Eigen::Vector3f::UnitZ()}};
  transform_normals(quarter, normals, normals);
  CHECK((normals - Eigen::Vector3f{-1, 0, 0}).norm() < 1e-6f);
}

TEST_CASE_TEMPLATE("a moved normal is a unit vector and perpendicular to the moved surface", T,
                   test::f2, test::f3, test::f5, test::d2, test::d3, test::d5) {
  using S = typename T::scalar;
  const auto transform = some_affine<T>();
  auto normals = test::random_points<T>(30, 1);
  normals.colwise().normalize();
  const auto moved = transform_normals(transform, normals);
  const auto directions = test::random_points<T>(30, 2);
  for (index_t i = 0; i < 30; ++i) {
    const auto n = normals.col(i);
    const auto tangent = (directions.col(i) - n * n.dot(directions.col(i))).eval();
    CHECK(std::abs(moved.col(i).dot(transform.linear() * tangent)) < S(1e-5));
    CHECK(moved.col(i).norm() == doctest::Approx(1).epsilon(1e-5));
  }
}

TEST_CASE("a zero normal, which stands for an unknown one, stays zero") {
  const Eigen::Matrix3Xd zero = Eigen::Matrix3Xd::Zero(3, 1);
  CHECK(transform_normals(some_affine<test::d3>(), zero).isZero(0));
}

TEST_CASE("what does not fit is refused before anything is written") {
  const auto points = test::random_points<test::f3>(4);
  Eigen::Matrix3Xf out = Eigen::Matrix3Xf::Constant(3, 5, 7);
  const auto transform = some_affine<test::f3>();
  CHECK_THROWS_AS(transform_points(transform, points, out), invalid_input);
  CHECK_THROWS_AS(transform_normals(transform, points, out), invalid_input);
  CHECK((out.array() == 7).all());

  Eigen::Affine3f flat = Eigen::Affine3f::Identity();
  flat.linear()(2, 2) = 0;
  CHECK_THROWS_AS((void)transform_normals(flat, points), invalid_input);
  flat.linear()(2, 2) = test::nan<float>;
  CHECK_THROWS_AS((void)transform_normals(flat, points), invalid_input);

  const Eigen::MatrixXf plane = Eigen::MatrixXf::Random(2, 4);
  CHECK_THROWS_AS((void)transform_points(transform, plane), invalid_input);
}
