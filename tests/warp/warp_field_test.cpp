// SPDX-License-Identifier: MIT
//
// Maps that bend: of points and normals, at nodes and between them.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import registration_support;
import test_support;

using namespace cilantro;

namespace {

/// Every node turned and shifted a little by its own place.
template <class T>
auto wavy(const deformation_graph<typename T::scalar, T::static_dimension>& graph, double size) {
  auto field = identity_field(graph);
  constexpr index_t d = T::dimension;
  using motion = typename decltype(field)::transform_type;
  for (index_t k = 0; k < graph.nodes().size(); ++k) {
    const Eigen::VectorXd node = graph.nodes()[k].template cast<double>();
    Eigen::VectorXd unknowns(rigid_motion::unknowns(d));
    for (index_t u = 0; u < unknowns.size(); ++u)
      unknowns[u] = size * std::sin(2 * node[u % d] + double(u));
    const auto step = rigid_motion::step(unknowns, d);
    field.set_node(k, make_transform<motion>(
                          step.linear, (node + step.translation - step.linear * node).eval()));
  }
  return field;
}

}  // namespace

static_assert(NormalMap<warp_field<float, 3>, 3> &&
              NormalMap<warp_field<double, 2, affine_motion>, 2>);
static_assert(PointMap<warp_field<double, 5>, 5> && PointMap<warp_field<float, dynamic>, dynamic>);

TEST_CASE_TEMPLATE("nodes that move alike move all points as one", T, ALL_SPACES) {
  using S = typename T::scalar;
  constexpr double exact = sizeof(S) == 4 ? 2e-6 : 1e-14;
  const auto points = test::random_points<T>(300, 1);
  const deformation_graph graph{points, {.spacing = 0.7}};
  auto field = identity_field(graph);
  CHECK((moved_points(field, points) - points).cwiseAbs().maxCoeff() < exact);
  using motion = typename decltype(field)::transform_type;
  const auto all = test::random_rigid<test::space<double, T::static_dimension>>(2, 0.8, 0.5);
  for (index_t k = 0; k < graph.nodes().size(); ++k) field.set_node(k, motion{all});
  CHECK(test::difference(field.at_node(3), all) < 1e-14);
  for (index_t i = 0; i < points.cols(); ++i) {
    const Eigen::VectorXd p = points.col(i).template cast<double>();
    const Eigen::VectorXd wanted = all.linear() * p + all.translation();
    CHECK((moved_point(field, i, points.col(i)).template cast<double>() - wanted).norm() <
          4 * exact);
    CHECK((field.at(points.col(i)).template cast<double>() - wanted).norm() < 4 * exact);
  }
  const point_vector<S, T::static_dimension> n = points.col(0).normalized();
  CHECK((field.normal(0, n).template cast<double>() - all.linear() * n.template cast<double>())
            .norm() < 4 * exact);
}

TEST_CASE_TEMPLATE("all at once is the same as one by one, with every vector target", T, test::f2,
                   test::f3, test::d3, test::dx) {
  auto points = test::random_points<T>(500, 3);
  points(0, 4) = test::nan<typename T::scalar>;
  const deformation_graph graph{points, {.spacing = 0.5}};
  const auto field = wavy<T>(graph, 0.3);
  auto one_by_one = points;
  for (index_t i = 0; i < points.cols(); ++i)
    one_by_one.col(i) = moved_point(field, i, points.col(i));
  CHECK(std::isnan(one_by_one(0, 4)));
  CHECK(test::same_bits(one_by_one.rightCols(495), moved_points(field, points).rightCols(495)));
  // Points that do not lie next to each other, and more threads than one.
  using S = typename T::scalar;
  Eigen::Matrix<S, dynamic, dynamic> wide(T::dimension + 2, 500);
  wide.topRows(T::dimension) = points;
  const auto apart = [&]() -> points_view<S, T::static_dimension> {
    if constexpr (T::static_dimension == dynamic)
      return {wide.data(), 500, T::dimension, T::dimension + 2};
    else
      return {wide.data(), 500, T::dimension + 2};
  }();
  CHECK(test::same_bits(moved_points(field, points), moved_points(field, apart, {.threads = 3})));
}

TEST_CASE_TEMPLATE("a field is undone by its inverse, point by point", T, test::f3, test::d2,
                   test::d3, test::dx) {
  using S = typename T::scalar;
  const auto points = test::random_points<T>(200, 5);
  const deformation_graph graph{points, {.spacing = 0.5}};
  const auto field = wavy<T>(graph, 0.05);
  int found = 0;
  for (index_t i = 0; i < points.cols(); ++i) {
    const auto back = field.inverse_at(field.at(points.col(i)));
    if (!back) continue;
    ++found;
    CHECK((field.at(*back) - field.at(points.col(i))).norm() < (sizeof(S) == 4 ? 1e-4 : 1e-12));
  }
  CHECK(found >= 195);
  const point_vector<S, T::static_dimension> lost =
      point_vector<S, T::static_dimension>::Constant(T::dimension, test::nan<S>);
  CHECK(!field.inverse_at(lost));
}

TEST_CASE("fields are resampled by other nodes, and composed") {
  const auto points = test::random_points<test::d3>(2000, 6);
  const deformation_graph coarse{points, {.spacing = 0.8}}, fine{points, {.spacing = 0.2}};
  const auto field = wavy<test::d3>(coarse, 0.1);
  const auto finer = resample(field, fine);
  CHECK((moved_points(finer, points) - moved_points(field, points)).colwise().norm().mean() < 0.02);
  for (index_t k = 0; k < fine.nodes().size(); ++k) {
    const Eigen::Vector3d node = fine.nodes()[k];
    CHECK((finer.at_node(k) * node - field.at(node)).norm() < 1e-12);
    CHECK((finer.at_node(k).linear().transpose() * finer.at_node(k).linear()).isIdentity(1e-12));
  }
  // First `inner`, then `outer`: exactly at the nodes.
  const auto inner = wavy<test::d3>(fine, 0.05), outer = wavy<test::d3>(coarse, 0.1);
  const auto both = compose(outer, inner);
  for (index_t k = 0; k < fine.nodes().size(); ++k) {
    const Eigen::Vector3d node = fine.nodes()[k];
    CHECK((both.at_node(k) * node - outer.at(inner.at_node(k) * node)).norm() < 1e-12);
  }
  Eigen::Matrix3Xd twice = moved_points(inner, points);
  for (index_t i = 0; i < twice.cols(); ++i) twice.col(i) = outer.at(twice.col(i));
  CHECK((moved_points(both, points) - twice).colwise().norm().mean() < 0.02);
}

TEST_CASE("a warped cloud keeps its attributes, and its normals are turned and of unit length") {
  const auto surface = test::bumpy_surface<test::d3>(400);
  point_cloud<double, 3> cloud = surface;
  cloud.points(1, 9) = test::nan<double>;
  cloud.set_attribute("weight", std::vector<double>(400, 0.25));
  const deformation_graph graph{cloud, {.spacing = 0.5}};
  const auto field = wavy<test::d3>(graph, 0.2);
  const auto moved = cloud | warp(field);
  CHECK(moved.attribute_as<double>("weight")[17] == 0.25);
  CHECK(std::isnan(moved.points(1, 9)));
  CHECK(moved.points.col(3) == field(3, cloud.points.col(3)));
  for (index_t i = 0; i < 400; ++i) CHECK(std::abs(moved.normals.col(i).norm() - 1) < 1e-12);
  CHECK((moved.normals.col(3) - field.normal(3, cloud.normals.col(3)).normalized()).norm() < 1e-12);
  // Another cloud is moved by the nodes nearest to each of its points.
  const auto part = warp(select(cloud, [](index_t i) { return i % 2 == 1; }), field);
  CHECK((part.points.col(1) - moved.points.col(3)).norm() < 1e-12);
  CHECK((part.normals.col(1) - moved.normals.col(3)).norm() < 1e-12);
  CHECK(warp(point_cloud<double, 3>{}, field).empty());
  CHECK((warp(cloud, warp_field<double, 3>{}).points.col(3) - cloud.points.col(3)).norm() == 0);
}

TEST_CASE("points that connections separate move with their own part only") {
  Eigen::Matrix2Xd points(2, 200);
  for (index_t i = 0; i < 200; ++i) points.col(i) << 0.05 * double(i % 100), i < 100 ? 0 : 0.01;
  std::vector<index_t> offsets{0};
  buffer<std::int32_t> indices;
  buffer<double> distances;
  for (std::int32_t i = 0; i < 200; ++i) {
    if (i % 100 != 99) {
      indices.push_back(i + 1);
      distances.push_back(0.05);
    }
    offsets.push_back(std::ssize(indices));
  }
  const deformation_graph graph{
      points, neighborhoods<double>{offsets, indices, distances}, {.spacing = 0.5}};
  auto field = identity_field(graph);
  for (index_t k = 0; k < graph.nodes().size(); ++k)
    if (graph.nodes()[k].y() > 0.005) {
      Eigen::Isometry2d up = Eigen::Isometry2d::Identity();
      up.translation().y() = 1;
      field.set_node(k, up);
    }
  const auto moved = moved_points(field, points);
  CHECK((moved.leftCols(100) - points.leftCols(100)).cwiseAbs().maxCoeff() < 1e-14);
  CHECK(((moved - points).rightCols(100).row(1).array() - 1).abs().maxCoeff() < 1e-14);
}

TEST_CASE("a field is a map of points that turns normals as surfaces turn") {
  const auto points = test::random_points<test::d3>(200, 10);
  const deformation_graph graph{points, {.spacing = 0.7}};
  const auto violations = check_point_map(wavy<test::d3>(graph, 0.4), points);
  for (const auto& violation : violations) MESSAGE(violation);
  CHECK(violations.empty());
}

TEST_CASE("what is out of reach of all nodes moves with the nearest") {
  const auto points = test::random_points<test::d3>(100, 9);
  const deformation_graph graph{points, {.spacing = 0.4}};
  auto field = identity_field(graph);
  Eigen::Isometry3d up = Eigen::Isometry3d::Identity();
  up.translation().z() = 10;
  for (index_t k = 0; k < graph.nodes().size(); ++k) field.set_node(k, up);
  CHECK((field.at(Eigen::Vector3d{50, 0, 0}) - Eigen::Vector3d{50, 0, 10}).norm() < 1e-12);
  const warp_field<double, dynamic> nothing;
  CHECK(nothing.at(Eigen::VectorXd::Ones(3)) == Eigen::VectorXd::Ones(3));
  CHECK(nothing.inverse_at(Eigen::VectorXd::Ones(3)).value() == Eigen::VectorXd::Ones(3));
  CHECK(nothing.normal_at(Eigen::VectorXd::Ones(3), Eigen::VectorXd::Ones(3)) ==
        Eigen::VectorXd::Ones(3));
  CHECK(identity_field(deformation_graph<double, 3>{}).size() == 0);
}

TEST_CASE("fields refuse points and motions of other sizes") {
  const auto points = test::random_points<test::dx>(20, 7);
  auto field = identity_field(deformation_graph{points, {.spacing = 0.5}});
  CHECK_THROWS_AS((void)field.at(Eigen::VectorXd::Zero(3)), invalid_input);
  CHECK_THROWS_AS(
      field.set_node(0, identity_transform<run_time_transform<double, Eigen::Isometry>>(3)),
      invalid_input);
  CHECK_THROWS_AS((void)moved_points(field, test::random_points<test::dx>(19, 7)), invalid_input);
  CHECK_THROWS_AS((void)field.at_node(-1), invalid_input);
  CHECK_THROWS_AS((void)field.at_node(field.graph().nodes().size()), invalid_input);
  point_cloud<double, dynamic> other{.points = Eigen::MatrixXd::Zero(3, 5)};
  CHECK_THROWS_AS((void)warp(other, field), invalid_input);
  const auto flat = test::random_points<test::space<double, 3>>(20, 8);
  const Eigen::MatrixXd in_three = flat;
  const deformation_graph<double, dynamic> three{in_three, {.spacing = 0.5}};
  CHECK_THROWS_AS((void)resample(field, three), invalid_input);
  CHECK_THROWS_AS((void)compose(field, identity_field(three)), invalid_input);
}
