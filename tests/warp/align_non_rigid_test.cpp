// SPDX-License-Identifier: MIT
//
// Non-rigid alignment in one call, of generated shapes whose truth is known.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stop_token>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import registration_support;
import test_support;

using namespace cilantro;

namespace {

/// An ellipsoid, and the same bent and shifted: point i of one is point i of the other.
struct bent_pair {
  point_cloud<double, 3> source, target;
};
bent_pair bent_ellipsoid(index_t count, double size) {
  bent_pair pair{{}, test::bumpy_surface<test::d3>(count, 1)};
  pair.target.normals.resize(3, 0);
  pair.source = pair.target;
  for (auto p : pair.source.points.colwise())
    p += size * Eigen::Vector3d{0.6 * std::sin(1.5 * p.z()), 0.4 * std::cos(1.5 * p.z()),
                                0.3 * std::sin(p.y())};
  return pair;
}
/// The mean distance to the nearest of the others. (How far a smooth surface has slid along itself,
/// nothing tells.)
double distance_to(const auto& others, const auto& points) {
  const kd_tree tree{others};
  double sum = 0;
  for (const auto p : points.colwise()) sum += double(tree.nearest(p)->distance);
  return sum / double(points.cols());
}
double rms(const Eigen::Matrix3Xd& difference) {
  return std::sqrt(difference.colwise().squaredNorm().mean());
}

}  // namespace

TEST_CASE("a bent surface is found, and what the result says of itself is right") {
  const auto [source, target] = bent_ellipsoid(4000, 0.3);
  int calls = 0;
  double share = 0;
  const auto found = align_non_rigid(source, target,
                                     {.spacing = 0.3,
                                      .max_distance = 0.6,
                                      .observer =
                                          [&](const non_rigid_iteration& now) {
                                            ++calls;
                                            CHECK(now.number == calls);
                                            CHECK(now.nodes > 0);
                                          },
                                      .monitor = {.progress = [&](double done) {
                                        CHECK(done >= share);
                                        share = done;
                                      }}});
  const Eigen::Matrix3Xd moved = moved_points(found.transform, source.points);
  CHECK(rms(moved - target.points) < rms(source.points - target.points));
  CHECK(found.iterations == calls);
  CHECK(share == 1);
  CHECK(found.overlap > 0.99);
  CHECK(found.unsupported_nodes.empty());
  CHECK(found.energy > 0);
  CHECK(found.energy < 1e-3);
  CHECK(found.transform.size() == 4000);
  CHECK(distance_to(target.points, source.points) > 0.08);
  CHECK(distance_to(target.points, moved) < 0.045);
  const auto cloud = source | warp(found.transform);
  CHECK((cloud.points - moved).cwiseAbs().maxCoeff() < 1e-12);
}

TEST_CASE_TEMPLATE("in two and more dimensions, and in float", T, test::f2, test::d2, test::f3,
                   test::dx) {
  const auto surface = test::bumpy_surface<T>(1500, 2);
  const auto target = surface.points;
  auto source = target;
  using S = typename T::scalar;
  for (auto p : source.colwise()) p[0] += S(0.15) * std::sin(S(2) * p[1]);
  const auto found = align_non_rigid(source, target, {.spacing = 0.4, .max_distance = 0.4});
  const auto moved = moved_points(found.transform, source);
  CHECK(distance_to(target, moved) < distance_to(target, source) / 3);
}

TEST_CASE("landmarks hold what the nearest points would get wrong") {
  // Turned by so much that the nearest points lead elsewhere.
  auto [source, target] = bent_ellipsoid(3000, 0.2);
  const Eigen::Isometry3d turn{Eigen::AngleAxisd{1.4, Eigen::Vector3d::UnitZ()}};
  source.points = transform_points(turn, source.points);
  non_rigid_options options{.spacing = 0.4, .max_distance = 1};
  const double without =
      rms(moved_points(align_non_rigid(source, target, options).transform, source.points) -
          target.points);
  for (index_t i = 0; i < 3000; i += 100) options.landmarks.emplace_back(i, i);
  const auto found = align_non_rigid(source, target, options);
  const double with = rms(moved_points(found.transform, source.points) - target.points);
  CHECK(with < 0.1);
  CHECK(with < without / 4);
}

TEST_CASE("affine nodes stretch") {
  const auto target = test::bumpy_surface<test::d3>(2000, 3);
  point_cloud<double, 3> source = target;
  source.points.row(2) *= 0.9;
  const auto found = align_non_rigid<affine_motion>(
      source, target, {.spacing = 0.5, .max_distance = 0.4, .rigidity = 0.01});
  CHECK(rms(moved_points(found.transform, source.points) - target.points) <
        0.6 * rms(source.points - target.points));
}

TEST_CASE("the same bits for any number of threads") {
  const auto [source, target] = bent_ellipsoid(3000, 0.2);
  const auto moved = [&](int threads) {
    return moved_points(
        align_non_rigid(source, target, {.spacing = 0.4, .max_distance = 0.3, .threads = threads})
            .transform,
        source.points);
  };
  const auto one = moved(1);
  CHECK(test::same_bits(one, moved(2)));
  CHECK(test::same_bits(one, moved(4)));
}

TEST_CASE("the result does not depend on where the origin is, also of clouds") {
  const auto [source, target] = bent_ellipsoid(2000, 0.2);
  const non_rigid_options options{.spacing = 0.4, .max_distance = 0.3};
  const Eigen::Matrix3Xd here =
      moved_points(align_non_rigid(source, target, options).transform, source.points);
  const Eigen::Vector3d far{1e5, -1e5, 1e5};
  const Eigen::Matrix3Xd from = source.points.colwise() + far, to = target.points.colwise() + far;
  const Eigen::Matrix3Xd there = moved_points(align_non_rigid(from, to, options).transform, from);
  CHECK(rms((there.colwise() - far) - here) < 1e-6 * 0.4);
  auto moving = source, onto = target;
  moving.origin = onto.origin = far;
  const auto found = align_non_rigid(moving, onto, options);
  CHECK(rms((moving | warp(found.transform)).points - here) < 1e-12);
  CHECK((moving | warp(found.transform)).origin == moving.origin);
  onto.origin = Eigen::Vector3d::Zero();
  CHECK_THROWS_AS((void)align_non_rigid(moving, onto, options), invalid_input);
}

TEST_CASE("nodes without pairs are those of the field that is returned") {
  // A dense scan of which the target shows the lower half.
  const auto [source, target] = bent_ellipsoid(30000, 0.1);
  const auto half = select(target, [&](index_t i) { return target.points(2, i) < 0; });
  const auto found = align_non_rigid(source, half, {.spacing = 0.5, .max_distance = 0.2});
  CHECK(found.unsupported_nodes.size() > 5);
  const auto nodes = found.transform.graph().nodes();
  CHECK(found.undetermined == 6 * std::ssize(found.unsupported_nodes));
  CHECK(found.unknowns == 6 * nodes.size());
  for (const auto node : found.unsupported_nodes) {
    REQUIRE(node < nodes.size());
    CHECK(nodes[node].z() > 0);
  }
}

TEST_CASE("a limit that limits nothing is none") {
  const auto [source, target] = bent_ellipsoid(500, 0.1);
  const auto moved = [&](double farthest) {
    return moved_points(
        align_non_rigid(source, target, {.spacing = 0.5, .max_distance = farthest}).transform,
        source.points);
  };
  const Eigen::Matrix3Xd wide = moved(1e6);
  CHECK(distance_to(target.points, wide) < distance_to(target.points, source.points));
  CHECK(test::same_bits(wide, moved(std::numeric_limits<double>::max())));
}

TEST_CASE("a spacing beyond the size of the cloud moves it as one") {
  const auto target = test::bumpy_surface<test::d3>(2000, 5);
  point_cloud<double, 3> source = target;
  source.points = transform_points(test::random_rigid<test::d3>(6, 0.05, 0.05), target.points);
  const auto found = align_non_rigid(source, target, {.spacing = 1000, .max_distance = 0.3});
  CHECK(found.transform.graph().nodes().size() == 1);
  CHECK(found.pairs > 1000);
  CHECK(rms(moved_points(found.transform, source.points) - target.points) <
        0.4 * rms(source.points - target.points));
}

TEST_CASE("what cannot be aligned is said, and stays") {
  const auto [source, target] = bent_ellipsoid(500, 0.2);
  const Eigen::Matrix3Xd far = target.points.array() + 100;
  const auto lost = align_non_rigid(source.points, far, {.spacing = 0.5, .max_distance = 1});
  CHECK(lost.status == icp_status::too_few_pairs);
  CHECK(!lost.converged());
  CHECK((moved_points(lost.transform, source.points) - source.points).cwiseAbs().maxCoeff() <
        1e-14);
  const Eigen::Matrix3Xd none(3, 0);
  CHECK(align_non_rigid(none, far, {.spacing = 0.5}).status == icp_status::too_few_pairs);
  CHECK(align_non_rigid(far, none, {.spacing = 0.5}).status == icp_status::too_few_pairs);
  // Points that are not finite take no part, and stay what they are.
  auto holes = source.points;
  holes(0, 3) = test::nan<double>;
  const auto found = align_non_rigid(holes, target.points, {.spacing = 0.5, .max_distance = 0.5});
  CHECK(found.pairs > 400);
  CHECK(found.non_finite == 1);
  CHECK(std::isnan(moved_points(found.transform, holes)(0, 3)));
  // One point, and all equal.
  const Eigen::Matrix3Xd one = target.points.leftCols(1);
  CHECK(align_non_rigid(one, one, {.spacing = 0.5}).transform.graph().nodes().size() == 1);
  const Eigen::Matrix3Xd equal = one.replicate(1, 20);
  CHECK(moved_points(align_non_rigid(equal, equal, {.spacing = 0.5}).transform, equal).allFinite());
}

TEST_CASE("a stop ends it with what has been reached") {
  const auto [source, target] = bent_ellipsoid(1000, 0.3);
  std::stop_source stop;
  int calls = 0;
  non_rigid_options options{.spacing = 0.4,
                            .max_distance = 0.6,
                            .observer =
                                [&](const non_rigid_iteration&) {
                                  if (++calls == 5) stop.request_stop();
                                },
                            .monitor = {.stop = stop.get_token()}};
  const auto found = align_non_rigid(source, target, options);
  CHECK(found.status == icp_status::cancelled);
  CHECK(found.iterations == 5);
  CHECK(rms(moved_points(found.transform, source.points) - target.points) <
        rms(source.points - target.points));
  CHECK(align_non_rigid(source, target, options).status == icp_status::cancelled);
}

TEST_CASE("options that make no sense are refused") {
  const auto [source, target] = bent_ellipsoid(50, 0.1);
  const auto refused = [&](const non_rigid_options& options) {
    CHECK_THROWS_AS((void)align_non_rigid(source, target, options), invalid_input);
  };
  refused({});
  refused({.spacing = test::nan<double>});
  refused({.spacing = 1, .max_distance = 0});
  refused({.spacing = 1, .max_distance = test::nan<double>});
  refused({.spacing = 1, .stiffness = -1});
  refused({.spacing = 1, .stiffness = 1e10});
  refused({.spacing = 1, .kernel_scale = -1});
  refused({.spacing = 1, .point_weight = -1});
  refused({.spacing = 1, .rigidity = 1});
  refused({.spacing = 1, .anchors = 0});
  refused({.spacing = 1, .landmarks = {{50, 0}}});
  refused({.spacing = 1, .landmarks = {{0, -1}}});
  refused({.spacing = 1, .max_iterations = -1});
  refused({.spacing = 1, .final_iterations = -1});
  refused({.spacing = 1, .landmark_weight = -1});
  refused({.spacing = 1, .tolerance = -1});
  refused({.spacing = 1, .threads = -1});
  const Eigen::Matrix2Xd flat = Eigen::Matrix2Xd::Random(2, 5);
  const Eigen::MatrixXd any_source = source.points, any_target = flat;
  CHECK_THROWS_AS((void)align_non_rigid(any_source, any_target, {.spacing = 1}), invalid_input);
}
