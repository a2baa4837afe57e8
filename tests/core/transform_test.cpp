// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdint>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

template <class T>
using affine = affine_transform<typename T::scalar, T::static_dimension>;
template <class T>
using rigid = rigid_transform<typename T::scalar, T::static_dimension>;

template <class T>
affine<T> some_affine() {
  auto transform = identity_transform<affine<T>>(T::dimension);
  transform.linear() = test::random_points<T>(T::dimension, 42).eval();
  transform.linear().diagonal().array() += 2;
  transform.translation() = test::random_points<T>(1, 43);
  return transform;
}

template <class T>
rigid<T> some_rigid(std::uint64_t seed = 44) {
  return make_transform<rigid<T>>(
      nearest_rotation(test::random_points<T>(T::dimension, seed).template cast<double>()),
      test::random_points<T>(1, seed + 1).col(0));
}

}  // namespace

TEST_CASE_TEMPLATE("points are moved as the transform says", T, test::f2, test::f3, test::f5,
                   test::fx, test::d2, test::d3, test::d5, test::dx) {
  const auto transform = some_affine<T>();
  const auto points = test::random_points<T>(50);
  const auto moved = transform_points(transform, points);
  for (index_t i = 0; i < 50; ++i) {
    const auto p = points.col(i).eval();
    CHECK((moved.col(i) - (transform.linear() * p + transform.translation())).norm() < 1e-5);
    CHECK((moved.col(i) - transform * p).norm() < 1e-5);
  }
}

TEST_CASE_TEMPLATE("transforms of any dimension compose, and their inverses undo them", T, test::f2,
                   test::f3, test::f5, test::fx, test::d2, test::d3, test::d5, test::dx) {
  const auto points = test::random_points<T>(20);
  const auto check = [&](const auto& first, const auto& second) {
    const auto apart = transform_points(second, transform_points(first, points));
    CHECK((transform_points(second * first, points) - apart).norm() < 1e-4);
    const auto inverse = [&] {
      if constexpr (T::static_dimension == dynamic)
        return first.inverse();
      else
        return test::inverse(first);
    }();
    const auto back = transform_points(inverse, transform_points(first, points));
    CHECK((back - points).norm() < 1e-4);
    const auto homogeneous = first.matrix();
    CHECK(homogeneous.rows() == T::dimension + 1);
    CHECK((homogeneous.topLeftCorner(T::dimension, T::dimension) - first.linear()).norm() == 0);
  };
  check(some_affine<T>(), some_affine<T>());
  check(some_rigid<T>(), some_rigid<T>(50));
}

TEST_CASE_TEMPLATE("the nearest rotation is a rotation, and none of many others is nearer", T,
                   test::d2, test::d3, test::d5, test::dx) {
  const Eigen::MatrixXd matrix = test::random_points<T>(T::dimension, 7);
  const Eigen::MatrixXd nearest = nearest_rotation(matrix);
  const auto identity = Eigen::MatrixXd::Identity(T::dimension, T::dimension);
  CHECK((nearest * nearest.transpose() - identity).norm() < 1e-13);
  CHECK(nearest.determinant() == doctest::Approx(1));
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    // Some are far away, some next to the answer.
    const auto other = nearest_rotation(nearest + (seed % 2 == 0 ? 1.0 : 0.01) *
                                                      test::random_points<T>(T::dimension, seed));
    CHECK((matrix - other).norm() >= (matrix - nearest).norm() - 1e-12);
  }
  CHECK((nearest_rotation(nearest) - nearest).norm() < 1e-13);
  // What a matrix says nothing about stays.
  CHECK(nearest_rotation(0 * matrix).isIdentity(1e-13));
  Eigen::MatrixXd along_one = Eigen::MatrixXd::Zero(T::dimension, T::dimension);
  along_one(0, 0) = 2;
  CHECK(nearest_rotation(along_one).isIdentity(1e-13));
  Eigen::MatrixXd mirror = identity;
  mirror(0, 0) = -1;
  CHECK(nearest_rotation(mirror).determinant() == doctest::Approx(1));
  CHECK_THROWS_AS((void)nearest_rotation(Eigen::MatrixXd::Zero(2, 3)), invalid_input);
  mirror(0, 0) = test::nan<double>;
  CHECK_THROWS_AS((void)nearest_rotation(mirror), invalid_input);
}

TEST_CASE("a transform with parts of different dimension, or without inverse, is refused") {
  const Eigen::MatrixXf square = Eigen::MatrixXf::Identity(3, 3);
  const Eigen::VectorXf two = Eigen::VectorXf::Zero(2);
  using run_time = affine_transform<float, dynamic>;
  CHECK_THROWS_AS((void)make_transform<Eigen::Affine3f>(square, two), invalid_input);
  CHECK_THROWS_AS((void)make_transform<Eigen::Affine2f>(square, Eigen::VectorXf::Zero(3)),
                  invalid_input);
  CHECK_THROWS_AS((run_time{square, two}), invalid_input);
  const run_time flat{Eigen::MatrixXf::Zero(3, 3), Eigen::VectorXf::Zero(3)};
  CHECK_THROWS_AS((void)flat.inverse(), invalid_input);
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
                   test::f2, test::f3, test::f5, test::fx, test::d2, test::d3, test::d5, test::dx) {
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
