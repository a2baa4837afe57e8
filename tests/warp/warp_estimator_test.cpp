// SPDX-License-Identifier: MIT
//
// Fields that are estimated from pairs: exact where the truth is known, and in what surrounds it.
#include <algorithm>
#include <array>
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

template <class Field, class Estimator>
auto fitted(const Estimator& estimator, Field field,
            const correspondences<typename Field::Scalar>& pairs, int iterations) {
  for (int i = 0; i < iterations; ++i) field = estimator.estimate(field, pairs).transform;
  return field;
}

/// A sheet in space, bent along a circle, which keeps lengths along it.
Eigen::Matrix3Xd flat_sheet(index_t along, index_t across, double length) {
  Eigen::Matrix3Xd points(3, along * across);
  for (index_t i = 0; i < points.cols(); ++i)
    points.col(i) << length * double(i % along) / double(along - 1),
        length * double(i / along) / double(across - 1) / 2, 0;
  return points;
}
Eigen::Matrix3Xd rolled(const Eigen::Matrix3Xd& sheet, double curvature) {
  Eigen::Matrix3Xd points = sheet;
  for (auto p : points.colwise()) {
    const double angle = curvature * p.x();
    p.x() = std::sin(angle) / curvature;
    p.z() = (1 - std::cos(angle)) / curvature;
  }
  return points;
}
double rms(const Eigen::Matrix3Xd& difference) {
  return std::sqrt(difference.colwise().squaredNorm().mean());
}

}  // namespace

TEST_CASE_TEMPLATE("a rigid motion of the target is found exactly, and bends nothing", T, test::f3,
                   test::d2, test::d3, test::dx) {
  using S = typename T::scalar;
  const double exact = sizeof(S) == 4 ? 1e-4 : 1e-9;
  const auto source = test::random_points<T>(400, 1);
  const auto motion = test::random_rigid<T>(2, 0.6, 1);
  const auto target = transform_points(motion, source);
  const deformation_graph graph{source, {.spacing = 0.6}};
  const warp_estimator estimator{source, target, graph, point_to_point{}};
  const auto pairs = test::same_indices<S>(source.cols());
  const auto field = fitted(estimator, estimator.identity(), pairs, 12);
  CHECK((moved_points(field, source) - target).cwiseAbs().maxCoeff() < exact);
  const auto energy = estimator.assess(field, pairs);
  CHECK(energy.total() < exact * exact);
  CHECK(energy.unsupported_nodes.empty());
}

TEST_CASE("a quarter turn costs the regulariser nothing") {
  const auto source = test::random_points<test::d3>(300, 3);
  Eigen::Isometry3d turn{
      Eigen::AngleAxisd{1.5707963267948966, Eigen::Vector3d{1, 2, 3}.normalized()}};
  const deformation_graph graph{source, {.spacing = 0.7}};
  auto field = identity_field(graph);
  for (index_t k = 0; k < graph.nodes().size(); ++k) field.set_node(k, turn);
  const Eigen::Matrix3Xd target = transform_points(turn, source);
  const warp_estimator estimator{source, target, graph, point_to_point{}};
  CHECK(estimator.assess(field, test::same_indices<double>(300)).total() < 1e-28);
}

TEST_CASE_TEMPLATE("affine nodes reproduce an affine map", T, test::d2, test::d3, test::dx) {
  const auto source = test::random_points<T>(600, 4);
  const auto map = test::random_affine<T>(5, 0.3, 1);
  const auto target = transform_points(map, source);
  const deformation_graph graph{source, {.spacing = 0.8}};
  const warp_estimator estimator{
      source, target, graph, point_to_point{}, {.stiffness = 0.1}, affine_motion{}};
  const auto field = fitted(estimator, estimator.identity(), test::same_indices<double>(600), 4);
  CHECK((moved_points(field, source) - target).cwiseAbs().maxCoeff() < 1e-7);
  CHECK(test::difference(field.at_node(2), map) < 1e-5);
}

TEST_CASE("rigidity keeps affine nodes near rotations") {
  const auto source = test::random_points<test::d3>(500, 6);
  Eigen::Matrix3Xd target = source;
  target.row(0) *= 1.3;
  const deformation_graph graph{source, {.spacing = 0.7}};
  const auto stretch = [&](double rigidity) {
    const warp_estimator estimator{
        source,         target, graph, point_to_point{}, {.stiffness = 1, .rigidity = rigidity},
        affine_motion{}};
    const auto field = fitted(estimator, estimator.identity(), test::same_indices<double>(500), 8);
    double sum = 0;
    for (index_t k = 0; k < graph.nodes().size(); ++k) {
      const Eigen::Matrix3d a = field.at_node(k).linear();
      sum += (a.transpose() * a - Eigen::Matrix3d::Identity()).norm();
    }
    return sum / double(graph.nodes().size());
  };
  const double free = stretch(0), held = stretch(1000);
  CHECK(free > 0.6);
  CHECK(held < 0.2);
}

TEST_CASE("the error of a known bend falls with the square of the spacing") {
  const auto sheet = flat_sheet(81, 41, 2);
  const auto target = rolled(sheet, 0.8);
  std::vector<double> errors;
  for (const double spacing : {0.4, 0.2, 0.1}) {
    const deformation_graph graph{sheet, {.spacing = spacing}};
    const warp_estimator estimator{sheet, target, graph, point_to_point{}, {.stiffness = 1e-4}};
    const auto field =
        fitted(estimator, estimator.identity(), test::same_indices<double>(sheet.cols()), 15);
    errors.push_back(rms(moved_points(field, sheet) - target));
  }
  CHECK(errors[0] < 0.02);
  CHECK(errors[1] < errors[0] / 2.5);
  CHECK(errors[2] < errors[1] / 2.5);
}

TEST_CASE("with great stiffness, a field moves as the rigid alignment does") {
  auto target = test::bumpy_surface<test::d3>(1500, 7);
  const auto motion = test::random_rigid<test::d3>(8, 0.05, 0.03);
  point_cloud<double, 3> source = target;
  source.points = transform_points(test::inverse(motion), target.points);
  source.normals.resize(3, 0);
  const nearest_neighbor_searcher searcher{source, target};
  const deformation_graph graph{source, {.spacing = 0.7}};
  const warp_estimator estimator{source, target, graph, point_to_plane{}, {.stiffness = 1e6}};
  const auto bent = icp(searcher, estimator, {.max_iterations = 40, .tolerance = 1e-10});
  const auto rigid = align(source, target, {.max_iterations = 40, .tolerance = 1e-10});
  CHECK((moved_points(bent.transform, source.points) -
         transform_points(rigid.transform, source.points))
            .colwise()
            .norm()
            .maxCoeff() < 1e-4);
  CHECK(bent.pairs == 1500);
  CHECK(bent.undetermined == 0);
  CHECK(bent.unknowns == 6 * graph.nodes().size());
}

TEST_CASE("the result does not depend on where the origin is, nor on the unit") {
  // Not on a grid, where rounding would decide which of two equally near nodes are linked.
  Eigen::Matrix3Xd sheet = test::random_points<test::d3>(500, 15, 0, 1);
  sheet.row(2).setZero();
  const auto target = rolled(sheet, 0.7);
  const auto pairs = test::same_indices<double>(sheet.cols());
  const auto moved = [&](double scale, const Eigen::Vector3d& shift) -> Eigen::Matrix3Xd {
    const Eigen::Matrix3Xd from = (scale * sheet).colwise() + shift,
                           to = (scale * target).colwise() + shift;
    const deformation_graph graph{from, {.spacing = 0.15 * scale}};
    const warp_estimator estimator{
        from, to, graph, point_to_point{}, {.stiffness = 0.1, .robust = welsch{0.3 * scale}}};
    const auto field = fitted(estimator, estimator.identity(), pairs, 6);
    return (moved_points(field, from).colwise() - shift) / scale;
  };
  const Eigen::Matrix3Xd here = moved(1, Eigen::Vector3d::Zero());
  CHECK(rms(here - target) < 0.05);
  for (const double far : {10.0, 1e3, 1e5})
    CHECK(rms(moved(1, {far, -far, far}) - here) < 1e-6 * 0.15);
  CHECK(rms(moved(1000, Eigen::Vector3d::Zero()) - here) < 1e-9);
}

TEST_CASE("stiffness counts the same for twice as many points") {
  const auto sheet = flat_sheet(31, 16, 1);
  const auto target = rolled(sheet, 1.2);
  const Eigen::Matrix3Xd nodes = flat_sheet(6, 3, 1);
  const auto moved = [&](const Eigen::Matrix3Xd& from,
                         const Eigen::Matrix3Xd& to) -> Eigen::Matrix3Xd {
    const deformation_graph graph{from, nodes_at{nodes}};
    const warp_estimator estimator{from, to, graph, point_to_point{}, {.stiffness = 5}};
    const auto field =
        fitted(estimator, estimator.identity(), test::same_indices<double>(from.cols()), 8);
    return moved_points(field, from);
  };
  Eigen::Matrix3Xd twice(3, 2 * sheet.cols()), twice_target(3, 2 * sheet.cols());
  twice << sheet, sheet;
  twice_target << target, target;
  const Eigen::Matrix3Xd once = moved(sheet, target);
  CHECK(rms(once - target) > 1e-3);  // The stiffness is felt.
  CHECK(rms(moved(twice, twice_target).leftCols(sheet.cols()) - once) < 1e-10);
}

TEST_CASE("nodes without pairs follow their neighbours, and islands stay; both are counted") {
  const auto sheet = flat_sheet(41, 21, 2);
  const Eigen::Vector3d shift{0.1, 0.2, 0.3};
  Eigen::Matrix3Xd source(3, sheet.cols() + 4);
  source << sheet, Eigen::Matrix3Xd::Constant(3, 4, 50);
  source.rightCols(4).row(0) << 50, 50.1, 50.2, 50.3;
  const Eigen::Matrix3Xd target = source.colwise() + shift;
  const deformation_graph graph{source, {.spacing = 0.25, .links = radius{0.6}}};
  const warp_estimator estimator{source, target, graph, point_to_point{}};
  correspondences<double> pairs;  // Of the left half only.
  for (std::int32_t i = 0; i < sheet.cols(); ++i)
    if (sheet(0, i) < 1) pairs.push_back({i, i, 0});
  const auto step = estimator.estimate(estimator.identity(), pairs);
  const auto field = fitted(estimator, estimator.identity(), pairs, 5);
  const Eigen::Matrix3Xd moved = moved_points(field, source);
  CHECK(((moved - target).leftCols(sheet.cols())).cwiseAbs().maxCoeff() < 1e-5);
  CHECK((moved - source).rightCols(4).cwiseAbs().maxCoeff() == 0);
  const auto energy = estimator.assess(field, pairs);
  CHECK(energy.unsupported_nodes.size() > 10);
  CHECK(step.fit.undetermined == 6 * std::ssize(energy.unsupported_nodes));
  for (const auto node : energy.unsupported_nodes) CHECK(graph.nodes()[node].x() > 0.9);
  CHECK(step.fit.overlap == doctest::Approx(double(pairs.size()) / double(source.cols())));
}

TEST_CASE("a robust kernel of the links keeps a cut sharp") {
  // Two halves that slide along each other.
  const auto sheet = flat_sheet(61, 31, 2);
  Eigen::Matrix3Xd target = sheet;
  for (auto p : target.colwise())
    if (p.x() > 1) p.y() += 0.3;
  const auto pairs = test::same_indices<double>(sheet.cols());
  const deformation_graph graph{sheet, {.spacing = 0.1}};
  const auto error = [&](const robust_kernel& smoothness) {
    const warp_estimator estimator{
        sheet, target, graph, point_to_point{}, {.stiffness = 20, .smoothness = smoothness}};
    const auto field = fitted(estimator, estimator.identity(), pairs, 30);
    double sum = 0;
    int count = 0;
    const Eigen::Matrix3Xd moved = moved_points(field, sheet);
    for (index_t i = 0; i < sheet.cols(); ++i)
      if (std::abs(sheet(0, i) - 1) > 0.25 && std::abs(sheet(0, i) - 1) < 0.5) {
        sum += (moved.col(i) - target.col(i)).norm();
        ++count;
      }
    return sum / count;
  };
  const double smooth = error({}), sharp = error(geman_mcclure{0.01}),
               less = error(geman_mcclure{0.1});
  CHECK(sharp < smooth / 5);
  CHECK(sharp < less);
}

TEST_CASE("the energy never rises, and at its end no node can make it smaller") {
  auto target = test::bumpy_surface<test::d3>(800, 9);
  Eigen::Matrix3Xd source = target.points;
  for (auto p : source.colwise())
    p += 0.15 * Eigen::Vector3d{std::sin(2 * p.y()), std::cos(p.z()), p.x() * p.y()};
  const deformation_graph graph{source, {.spacing = 0.6}};
  const combined_metric metric{weighted_term{point_to_plane{}},
                               weighted_term{point_to_point{}, 0.1}};
  const warp_estimator estimator{source, target, graph, metric, {.stiffness = 0.5}};
  const auto pairs = test::same_indices<double>(800);
  auto field = estimator.identity();
  double last = estimator.assess(field, pairs).total();
  for (int i = 0; i < 25; ++i) {
    field = estimator.estimate(field, pairs).transform;
    const double now = estimator.assess(field, pairs).total();
    CHECK(now <= last * (1 + 1e-12));
    last = now;
  }
  random_stream random{10};
  for (int i = 0; i < 50; ++i) {
    auto other = field;
    const auto k = static_cast<index_t>(random.uniform(0, double(graph.nodes().size()) - 1e-9));
    Eigen::VectorXd unknowns(6);
    for (auto& u : unknowns) u = 1e-3 * random.uniform(-1, 1);
    const auto step = rigid_motion::step(unknowns, 3);
    Eigen::Isometry3d move = Eigen::Isometry3d::Identity();
    const Eigen::Vector3d at = field.at_node(k) * Eigen::Vector3d{graph.nodes()[k]};
    move.linear() = step.linear;
    move.translation() = at + step.translation - step.linear * at;
    other.set_node(k, move * field.at_node(k));
    CHECK(estimator.assess(other, pairs).total() >= last * (1 - 1e-9));
  }
}

TEST_CASE("each term of a metric may have pairs of its own") {
  const auto sheet = flat_sheet(31, 16, 1);
  const auto target = rolled(sheet, 0.6);
  const deformation_graph graph{sheet, {.spacing = 0.2}};
  const combined_metric metric{weighted_term{point_to_point{}}, weighted_term{point_to_point{}, 3}};
  const warp_estimator estimator{sheet, target, graph, metric, {.stiffness = 0.01}};
  const auto all = test::same_indices<double>(sheet.cols());
  const correspondences<double> some{all[0], all[30], all[200]};
  const combined_searcher both{known_pairs_searcher{sheet, target, all},
                               known_pairs_searcher{sheet, target, some}};
  const auto found = icp(both, estimator, {.max_iterations = 20});
  CHECK(found.pairs == std::ssize(all) + 3);
  CHECK(rms(moved_points(found.transform, sheet) - target) < 0.02);
  CHECK(found.overlap == 1);
}

TEST_CASE_TEMPLATE("the same bits for any number of threads, and every vector target", T, test::f3,
                   test::d2) {
  using S = typename T::scalar;
  const auto target = test::bumpy_surface<T>(3000, 11);
  point_cloud<S, T::static_dimension> source = target;
  for (auto p : source.points.colwise()) p.x() += S(0.1) * std::sin(3 * p.y());
  const deformation_graph graph{source, {.spacing = 0.1}};
  const auto pairs = test::same_indices<S>(3000);
  const auto moved = [&](int threads) {
    const warp_estimator estimator{
        source, target, graph, symmetric{}, {.robust = welsch{0.2}, .threads = threads}};
    auto field = estimator.identity();
    auto memory = typename std::remove_cvref_t<decltype(estimator)>::memory{};
    for (int i = 0; i < 3; ++i) field = estimator.estimate(field, pairs, memory).transform;
    return moved_points(field, source.points);
  };
  const auto one = moved(1);
  CHECK(test::same_bits(one, moved(2)));
  CHECK(test::same_bits(one, moved(4)));
  for (const auto vectors : test::available_targets()) {
    const test::using_target now{vectors};
    CHECK(test::same_bits(one, moved(2)));
  }
}

TEST_CASE("increments forget what was bent before, and shape does not") {
  const auto sheet = flat_sheet(31, 16, 1);
  const auto target = rolled(sheet, 1);
  const deformation_graph graph{sheet, {.spacing = 0.15}};
  const auto error = [&](warp_regularizer regularizer) {
    const warp_estimator estimator{
        sheet, target, graph, point_to_point{}, {.stiffness = 1000, .regularizer = regularizer}};
    return rms(moved_points(fitted(estimator, estimator.identity(),
                                   test::same_indices<double>(sheet.cols()), 60),
                            sheet) -
               target);
  };
  CHECK(error(warp_regularizer::shape) > 1.5 * error(warp_regularizer::increments));
}

TEST_CASE("nothing to go by leaves a field as it is") {
  Eigen::Matrix3Xd source = test::random_points<test::d3>(60, 12);
  source(0, 5) = test::nan<double>;
  const Eigen::Matrix3Xd target = source.array() + 0.1;
  const deformation_graph graph{source, {.spacing = 0.5}};
  const warp_estimator estimator{source, target, graph, point_to_point{}};
  const auto step = estimator.estimate(estimator.identity(), correspondences<double>{});
  CHECK(step.fit.pairs == 0);
  CHECK(step.fit.undetermined == step.fit.unknowns);
  CHECK((moved_points(step.transform, source) - source).rightCols(50).cwiseAbs().maxCoeff() <
        1e-15);
  // A pair of a point that is not finite counts for nothing.
  const auto lost = estimator.estimate(estimator.identity(), correspondences<double>{{5, 5, 0}});
  CHECK(lost.fit.pairs == 0);
  const Eigen::Matrix3Xd none(3, 0);
  const deformation_graph empty{none, {.spacing = 1}};
  const warp_estimator nothing{none, target, empty, point_to_point{}};
  CHECK(nothing.estimate(nothing.identity(), correspondences<double>{}).fit.unknowns == 0);
  const nearest_neighbor_searcher searcher{none, target};
  CHECK(icp(searcher, nothing).status == icp_status::too_few_pairs);
  const warp_estimator without_graph{none, target, deformation_graph<double, 3>{},
                                     point_to_point{}};
  CHECK(icp(searcher, without_graph).status == icp_status::too_few_pairs);
}

TEST_CASE("a bent field stays bent without pairs, as estimators of all kinds promise") {
  const auto surface = test::bumpy_surface<test::d3>(200, 16);
  const deformation_graph graph{surface, {.spacing = 0.6}};
  auto field = identity_field(graph);
  Eigen::Isometry3d up = Eigen::Isometry3d::Identity();
  up.translation().z() = 0.2;
  field.set_node(1, up);
  const warp_estimator estimator{surface, surface, graph, point_to_plane{}};
  const auto step = estimator.estimate(field, correspondences<double>{});
  CHECK(test::same_bits(moved_points(step.transform, surface.points),
                        moved_points(field, surface.points)));
  CHECK(step.change.translation == 0);
  CHECK(check_transform_estimator(estimator, estimator.identity(), test::same_indices<double>(200))
            .empty());
}

TEST_CASE("however stiff, a field follows what moves as a whole") {
  const auto source = test::random_points<test::d3>(300, 17);
  const Eigen::Matrix3Xd target = source.colwise() + Eigen::Vector3d{0.1, -0.2, 0.3};
  const deformation_graph graph{source, {.spacing = 0.6}};
  for (const double stiffness : {1e-6, 1.0, 1e6, 1e9}) {
    const warp_estimator estimator{
        source, target, graph, point_to_point{}, {.stiffness = stiffness}};
    const auto field = fitted(estimator, estimator.identity(), test::same_indices<double>(300), 3);
    CHECK((moved_points(field, source) - target).cwiseAbs().maxCoeff() < 1e-4);
  }
}

TEST_CASE("an estimator refuses what is not its own") {
  const auto source = test::random_points<test::d3>(60, 13),
             target = test::random_points<test::d3>(60, 14);
  const deformation_graph graph{source, {.spacing = 0.5}}, other{source, {.spacing = 0.4}};
  CHECK_THROWS_AS((warp_estimator{target, target, graph, point_to_point{}}), invalid_input);
  CHECK_THROWS_AS((warp_estimator{source, target, graph, point_to_plane{}}),
                  invalid_input);  // No normals.
  CHECK_THROWS_AS((warp_estimator{source, target, graph, point_to_point{}, {.stiffness = -1}}),
                  invalid_input);
  CHECK_THROWS_AS(
      (warp_estimator{source, target, graph, point_to_point{}, {.stiffness = test::nan<double>}}),
      invalid_input);
  CHECK_THROWS_AS((warp_estimator{source, target, graph, point_to_point{}, {.rigidity = 1}}),
                  invalid_input);
  const warp_estimator estimator{source, target, graph, point_to_point{}};
  CHECK_THROWS_AS((void)estimator.estimate(identity_field(other), correspondences<double>{}),
                  invalid_input);
  CHECK_THROWS_AS(
      (void)estimator.estimate(estimator.identity(), correspondences<double>{{60, 0, 0}}),
      invalid_input);
  CHECK_THROWS_AS(  // Pairs by descending source.
      (void)estimator.estimate(estimator.identity(), correspondences<double>{{5, 5, 0}, {2, 2, 0}}),
      invalid_input);
  CHECK_THROWS_AS(
      (warp_estimator{source,
                      target,
                      graph,
                      point_to_point{},
                      {.smoothness = huber{1}, .regularizer = warp_regularizer::increments}}),
      invalid_input);
  const warp_estimator odd{
      source, target, graph, point_to_point{}, {.smoothness = [](double) { return -1.0; }}};
  CHECK_THROWS_AS((void)odd.estimate(odd.identity(), correspondences<double>{{0, 0, 0}}),
                  invalid_input);
  CHECK_THROWS_AS((void)estimator.with(point_to_point{}, {.stiffness = -1}), invalid_input);
}
