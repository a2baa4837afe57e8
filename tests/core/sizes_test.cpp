// SPDX-License-Identifier: MIT
#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

template <class S, int D>
index_t size_of(const point_ref<S, D>& point) {
  return point.size();
}

}  // namespace

static_assert(!std::is_convertible_v<Eigen::Vector2f, point_ref<float, 3>>);
static_assert(!std::is_convertible_v<Eigen::Vector3d, point_ref<float, 3>>);
static_assert(!std::is_convertible_v<Eigen::Matrix4Xf, sized<Eigen::Matrix3Xf>>);
static_assert(!std::is_convertible_v<Eigen::Matrix3Xd, sized<Eigen::Matrix3Xf>>);
static_assert(PointsSource<sized<Eigen::Matrix3Xf>>);

TEST_CASE_TEMPLATE(
    "an argument that is a point is seen in place, and checked where its size is not fixed", S,
    float, double) {
  const Eigen::Matrix<S, 3, 1> fixed{1, 2, 3};
  CHECK(point_ref<S, 3>{fixed}.data() == fixed.data());
  const Eigen::VectorX<S> three = fixed, two = three.head(2), none;
  CHECK(size_of<S, 3>(three) == 3);
  CHECK(point_ref<S, 3>{2 * fixed + fixed} == 3 * fixed);
  CHECK_THROWS_WITH_AS((void)(size_of<S, 3>(two)), "a point has 2 coordinates, and 3 are expected",
                       invalid_input);
  CHECK_THROWS_AS((void)(size_of<S, 3>(none)), invalid_input);
  CHECK(size_of<S, dynamic>(two) == 2);
}

TEST_CASE("nothing of another size is put into a sized matrix") {
  const Eigen::MatrixXf rows = Eigen::MatrixXf::Random(50, 3), square = rows.topRows(3);
  sized<Eigen::Matrix3Xf> points;
  CHECK_THROWS_WITH_AS(
      points = rows,
      "a matrix of 50 x 3 cannot be put into one of 3 x N: points are columns, so transpose it",
      invalid_input);
  CHECK_THROWS_AS((sized<Eigen::Matrix3Xf>{rows}), invalid_input);
  points = rows.transpose();
  CHECK(points == rows.transpose());
  points = square;
  CHECK(points.cols() == 3);
  points = Eigen::Matrix3Xf::Zero(3, 7);
  CHECK(points.cols() == 7);
  const Eigen::Matrix3Xf& plain = points;
  CHECK(plain.cols() == 7);
}

TEST_CASE("rows are no points of a cloud") {
  const Eigen::MatrixXf rows = Eigen::MatrixXf::Random(50, 3);
  CHECK_THROWS_AS(((void)point_cloud<float, 3>{.points = rows}), invalid_input);
  CHECK((point_cloud<float, 3>{.points = rows.transpose()}.size() == 50));
  point_cloud<float, 3> cloud{.points = rows.transpose()};
  CHECK_THROWS_AS(cloud.normals = rows, invalid_input);
  CHECK_THROWS_AS(cloud.colors = rows, invalid_input);
  CHECK_THROWS_AS(cloud.origin = Eigen::VectorXd::Zero(2).eval(), invalid_input);
  CHECK(cloud.size() == 50);
}

TEST_CASE("models measure only points of their dimension") {
  const Eigen::VectorXd two = Eigen::VectorXd::Zero(2), three = Eigen::VectorXd::Zero(3);
  const line_model<3> line{Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX()};
  CHECK(line.distance(three) == 0);
  CHECK_THROWS_AS((void)line.distance(two), invalid_input);
  CHECK_THROWS_AS((void)(cylinder_model{line, 1}.signed_distance(two)), invalid_input);
  CHECK_THROWS_AS((void)(sphere_model<3>{Eigen::Vector3d::Zero(), 1}.signed_distance(two)),
                  invalid_input);
  CHECK_THROWS_AS((void)(sphere_model<dynamic>{three, 1}.signed_distance(two)), invalid_input);
  CHECK_THROWS_AS(
      (void)(circle_model{Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX(), 1}.distance(two)),
      invalid_input);
  const hyperplane_model<3> plane{Eigen::Vector3d::UnitX(), 1};
  CHECK_THROWS_AS((void)plane.signed_distance(two), invalid_input);
  CHECK_THROWS_AS((void)plane.project(two), invalid_input);
  CHECK_THROWS_AS((void)angle_between(two, three), invalid_input);
}

TEST_CASE_TEMPLATE("searchers and grids answer only queries of their dimension", T, test::f3,
                   test::d3, test::fx, test::dx) {
  using S = typename T::scalar;
  const auto points = test::random_points<T>(100);
  const kd_tree tree{points};
  const brute_force_searcher brute{points};
  const voxel_grid grid{points, 0.5};
  std::vector<neighbor<S>> found;
  for (const index_t size : {0, 2, 7}) {
    const Eigen::VectorX<S> query = Eigen::VectorX<S>::Zero(size);
    CHECK_THROWS_AS((void)tree.find(query, knn{1}), invalid_input);
    CHECK_THROWS_AS((void)tree.nearest(query), invalid_input);
    CHECK_THROWS_AS((void)tree.nearest_two(query), invalid_input);
    CHECK_THROWS_AS(brute.find(query, knn{1}, found), invalid_input);
    CHECK_THROWS_AS((void)grid.find(query), invalid_input);
  }
}

TEST_CASE_TEMPLATE(
    "points of one coordinate are moved and turned where they are, and nothing beside", T, float,
    double) {
  using row = point_matrix<T, 1>;
  row memory = row::Zero(1, 200);
  const row points = row::LinSpaced(10, 0, 9);
  auto out = memory.leftCols(10);
  Eigen::Map<row> mapped{memory.data(), 1, 10};
  auto move = Eigen::Transform<T, 1, Eigen::Isometry>::Identity();
  move.translation()[0] = 2;
  transform_points(move, points, mapped);
  CHECK(out == row{points.array() + 2});
  CHECK(memory.rightCols(190).isZero(0));

  mapped.setOnes();
  auto mirror = Eigen::Transform<T, 1, Eigen::Affine>::Identity();
  mirror.linear()(0, 0) = -1;
  transform_normals(mirror, row::Ones(1, 10).eval(), mapped);
  CHECK((out.array() == -1).all());
  CHECK(memory.rightCols(190).isZero(0));

  mapped.setOnes();
  orient_to_viewpoint(mapped, points, {-5});
  CHECK((out.array() == -1).all());
  orient_to_reference(mapped, row::Ones(1, 10).eval());
  CHECK((out.array() == 1).all());
  CHECK(memory.rightCols(190).isZero(0));

  const point_cloud<T, 1> cloud{.points = points};
  CHECK(transform(cloud, move).points == row{points.array() + 2});
}

TEST_CASE("arrays are checked like matrices, and so are run-time transforms and cells") {
  const Eigen::ArrayXXf two(2, 100), five(5, 3);
  point_cloud<float, 3> cloud;
  CHECK_THROWS_AS(cloud.points = two, invalid_input);
  CHECK_THROWS_AS(cloud.points = five, invalid_input);
  cloud.points = Eigen::ArrayXXf::Ones(3, 4);
  CHECK(cloud.points == Eigen::Matrix3Xf::Ones(3, 4));
  const auto here = run_time_transform<double, Eigen::Isometry>::Identity(3);
  CHECK_THROWS_AS((void)(here * Eigen::VectorXd::Ones(2).eval()), invalid_input);
  CHECK_THROWS_AS((void)(here * run_time_transform<double, Eigen::Isometry>::Identity(2)),
                  invalid_input);
  const auto points = test::random_points<test::f3>(10);
  const voxel_grid grid{points, 0.5};
  CHECK_THROWS_AS((void)grid.find_cell(Eigen::VectorX<std::int64_t>::Zero(2).eval()),
                  invalid_input);
  CHECK_THROWS_AS((void)rigid_motion::step(Eigen::VectorXd::Zero(2), 3), invalid_input);
  CHECK(!rigid_motion::step(Eigen::VectorXd::Constant(6, test::nan<double>), 3).linear.allFinite());
  CHECK_THROWS_AS((void)solve(Eigen::MatrixXd::Identity(3, 3), Eigen::MatrixXd::Ones(2, 1)),
                  invalid_input);
  CHECK_THROWS_AS((void)determinant(Eigen::MatrixXd::Ones(2, 3)), invalid_input);
}
