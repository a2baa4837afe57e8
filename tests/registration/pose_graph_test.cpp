// SPDX-License-Identifier: MIT
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <sstream>
#include <stop_token>
#include <vector>

#include "spaces.hpp"

import cilantro;
import registration_support;
import test_support;

using namespace cilantro;

namespace {

template <int D>
using pose_of = rigid_transform<double, D>;
template <int D>
using space_of = test::space<double, D>;

template <int D>
Eigen::VectorXd noise(std::uint64_t seed, double size) {
  random_stream random{seed};
  Eigen::VectorXd x(pose_unknowns<D>);
  for (auto& u : x) u = size * random.normal();
  return x;
}

/// A small motion with these unknowns.
template <int D>
pose_of<D> small(const Eigen::VectorXd& unknowns) {
  const auto step = rigid_motion::step(unknowns, D);
  return make_transform<pose_of<D>>(step.linear, step.translation);
}

/// An edge that is right, but for a small motion in the target's coordinates.
template <int D>
pose_edge<D> measured(const std::vector<pose_of<D>>& truth, index_t source, index_t target,
                      const Eigen::VectorXd& error = Eigen::VectorXd::Zero(pose_unknowns<D>)) {
  return {.source = source,
          .target = target,
          .transform = small<D>(error) * truth[target].inverse() * truth[source]};
}

template <int D>
std::vector<pose_of<D>> random_poses(index_t count, double angle = 0.5) {
  std::vector<pose_of<D>> poses;
  for (index_t i = 0; i < count; ++i)
    poses.push_back(i == 0 ? pose_of<D>::Identity()
                           : test::random_rigid<space_of<D>>(std::uint64_t(i), angle, 2));
  return poses;
}

/// Every node with the next, the last with the first, and some across.
template <int D>
std::vector<pose_edge<D>> loop(const std::vector<pose_of<D>>& truth, double error,
                               bool across = true) {
  const index_t n = std::ssize(truth);
  std::vector<pose_edge<D>> edges;
  for (index_t i = 0; i < n; ++i)
    edges.push_back(measured<D>(truth, (i + 1) % n, i, noise<D>(std::uint64_t(100 + i), error)));
  if (across)
    for (index_t i = 0; i + 3 < n; i += 2)
      edges.push_back(measured<D>(truth, i + 3, i, noise<D>(std::uint64_t(500 + i), error)));
  return edges;
}

template <int D>
std::vector<pose_of<D>> disturbed(const std::vector<pose_of<D>>& poses, double size) {
  auto others = poses;
  for (index_t i = 1; i < std::ssize(others); ++i)
    others[i] = poses[i] * small<D>(noise<D>(std::uint64_t(i), size));
  return others;
}

double worst(const auto& a, const auto& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, test::difference(a[i], b[i]));
  return most;
}

/// A symmetric matrix that tells all directions apart.
template <int D>
pose_information<D> any_information(std::uint64_t seed) {
  random_stream random{seed};
  pose_information<D> root;
  for (auto& x : root.reshaped()) x = random.uniform(-1, 1);
  return root * root.transpose() + 0.1 * pose_information<D>::Identity();
}

/// The twist of a motion by its definition: the eigenvalue-free series of the matrix logarithm.
template <int D>
Eigen::VectorXd plain_logarithm(const pose_of<D>& motion) {
  using matrix = Eigen::Matrix<double, D + 1, D + 1>;
  // By Newton's square roots until the series converges fast.
  matrix m = motion.matrix();
  int halvings = 0;
  for (; (m - matrix::Identity()).norm() > 0.01; ++halvings) {
    matrix y = m, z = matrix::Identity();
    for (int i = 0; i < 30; ++i) {
      const matrix next = (y + *solve(z, matrix::Identity())) / 2;
      z = ((z + *solve(y, matrix::Identity())) / 2).eval();
      y = next;
    }
    m = y;
  }
  matrix sum = matrix::Zero(), power = m - matrix::Identity();
  for (int k = 1; k < 12; ++k, power = (power * (m - matrix::Identity())).eval())
    sum += (k % 2 == 1 ? 1.0 : -1.0) / k * power;
  sum *= std::ldexp(1.0, halvings);
  Eigen::VectorXd x(pose_unknowns<D>);
  if constexpr (D == 2)
    x << sum(1, 0), sum(0, 2), sum(1, 2);
  else
    x << sum(2, 1), sum(0, 2), sum(1, 0), sum(0, 3), sum(1, 3), sum(2, 3);
  return x;
}

template <int D>
double plain_cost(const std::vector<pose_edge<D>>& edges, const std::vector<pose_of<D>>& poses) {
  double sum = 0;
  for (const auto& edge : edges) {
    const pose_of<D> left =
        poses[edge.target].inverse() * poses[edge.source] * edge.transform.inverse();
    const Eigen::VectorXd r = plain_logarithm<D>(left);
    sum += r.dot(edge.information * r);
  }
  return sum;
}

/// Gauss–Newton as one would write it down: dense, with differences in place of derivatives.
template <int D>
std::vector<pose_of<D>> plain_optimum(const std::vector<pose_edge<D>>& edges,
                                      std::vector<pose_of<D>> poses) {
  constexpr index_t u = pose_unknowns<D>;
  const index_t n = std::ssize(poses), m = std::ssize(edges);
  const auto residuals = [&](const std::vector<pose_of<D>>& at) {
    Eigen::VectorXd all(m * u);
    for (index_t e = 0; e < m; ++e) {
      const auto& edge = edges[e];
      const pose_of<D> left =
          at[edge.target].inverse() * at[edge.source] * edge.transform.inverse();
      all.segment<u>(e * u) = plain_logarithm<D>(left);
    }
    return all;
  };
  for (int i = 0; i < 8; ++i) {
    Eigen::MatrixXd jacobian(m * u, (n - 1) * u);
    for (index_t k = 0; k < (n - 1) * u; ++k) {
      auto up = poses, down = poses;
      const Eigen::VectorXd step = 1e-5 * Eigen::VectorXd::Unit(u, k % u);
      up[1 + k / u] = up[1 + k / u] * small<D>(step);
      down[1 + k / u] = down[1 + k / u] * small<D>(-step);
      jacobian.col(k) = (residuals(up) - residuals(down)) / 2e-5;
    }
    Eigen::MatrixXd weighted = jacobian;
    for (index_t e = 0; e < m; ++e)
      weighted.middleRows<u>(e * u) = edges[e].information * jacobian.middleRows<u>(e * u);
    const Eigen::VectorXd step =
        *solve(weighted.transpose() * jacobian, -weighted.transpose() * residuals(poses));
    for (index_t k = 0; k + 1 < n; ++k)
      poses[k + 1] = poses[k + 1] * small<D>(step.segment<u>(k * u));
  }
  return poses;
}

}  // namespace

TEST_CASE_TEMPLATE("a loop of exact edges is its own answer", T, test::d2, test::d3) {
  constexpr int D = T::static_dimension;
  const auto truth = random_poses<D>(12);
  const auto edges = loop<D>(truth, 0);
  const auto same = optimize_poses(truth, edges);
  CHECK(same.converged());
  CHECK(worst(same.poses, truth) < 1e-14);
  CHECK(same.cost < 1e-25);
  const auto found = optimize_poses(disturbed<D>(truth, 0.1), edges);
  CHECK(found.converged());
  CHECK(found.cost < 1e-20);
  CHECK(worst(found.poses, truth) < 1e-10);
  CHECK(found.iterations < 10);
  CHECK(found.components == 1);
  CHECK(found.undetermined == 0);
  for (const auto& edge : found.edges) CHECK(edge.verdict == edge_verdict::kept);
}

// The reference is a minute's work under the sanitizers, and is not what they look at.
#if __has_feature(address_sanitizer)
#define REFERENCE_SPACES test::d2
#else
#define REFERENCE_SPACES test::d2, test::d3
#endif
TEST_CASE_TEMPLATE("noisy edges end where a dense reference ends", T, REFERENCE_SPACES) {
  constexpr int D = T::static_dimension;
  const auto truth = random_poses<D>(6);
  auto edges = loop<D>(truth, 0.05);
  for (std::size_t e = 0; e < edges.size(); ++e) edges[e].information = any_information<D>(e);
  const auto start = disturbed<D>(truth, 0.05);
  const auto found = optimize_poses(start, edges);
  CHECK(found.converged());
  const auto reference = plain_optimum<D>(edges, start);
  CHECK(worst(found.poses, reference) < 1e-6);
  CHECK(found.cost == doctest::Approx(plain_cost<D>(edges, found.poses)).epsilon(1e-9));
  CHECK(found.cost_at_start == doctest::Approx(plain_cost<D>(edges, start)).epsilon(1e-9));
  CHECK(found.cost <= plain_cost<D>(edges, reference) * (1 + 1e-9));
}

TEST_CASE_TEMPLATE("float poses are optimised in double", T, test::f2, test::f3) {
  constexpr int D = T::static_dimension;
  const auto truth = random_poses<D>(6);
  std::vector<rigid_transform<float, D>> start;
  for (const auto& p : disturbed<D>(truth, 0.05)) start.push_back(p.template cast<float>());
  const auto found = optimize_poses(start, loop<D>(truth, 0));
  CHECK(found.converged());
  CHECK(found.cost < 1e-12);
  for (std::size_t i = 0; i < start.size(); ++i)
    CHECK(test::difference(found.poses[i], truth[i].template cast<float>()) < 1e-6);
}

TEST_CASE("along a line, the error of a loop is shared by variances") {
  // Three steps of 1 that a fourth edge says are 3.6 in all.
  std::vector<pose_edge<2>> edges;
  for (index_t i = 0; i < 3; ++i) {
    edges.push_back({.source = i + 1, .target = i});
    edges.back().transform.translation().x() = 1;
  }
  edges[1].information *= 4;
  edges.push_back({.source = 3, .target = 0});
  edges.back().transform.translation().x() = 3.6;
  edges.back().information *= 2;
  const auto found = optimize_poses(4, edges);
  CHECK(found.converged());
  // Variances are 1, 1/4, 1 and 1/2: of the 0.6, each takes its share of 2.75.
  CHECK(found.poses[1].translation().x() == doctest::Approx(1 + 0.6 / 2.75));
  CHECK(found.poses[2].translation().x() == doctest::Approx(2 + 0.6 * 1.25 / 2.75));
  CHECK(found.poses[3].translation().x() == doctest::Approx(3 + 0.6 * 2.25 / 2.75));
  CHECK(found.cost == doctest::Approx(0.36 / 2.75));
}

TEST_CASE_TEMPLATE("an edge says the same from its other side", T, test::d2, test::d3) {
  constexpr int D = T::static_dimension;
  const auto truth = random_poses<D>(7, 1.5);
  auto edges = loop<D>(truth, 0.1);
  for (std::size_t e = 0; e < edges.size(); ++e) edges[e].information = any_information<D>(e);
  auto turned = edges;
  for (std::size_t e = 0; e < edges.size(); e += 2) turned[e] = reversed(edges[e]);
  const auto start = disturbed<D>(truth, 0.1);
  const auto one = optimize_poses(start, edges), other = optimize_poses(start, turned);
  CHECK(one.converged());
  CHECK(worst(one.poses, other.poses) < 1e-9);
  for (std::size_t e = 0; e < edges.size(); ++e)
    CHECK(one.edges[e].chi_square == doctest::Approx(other.edges[e].chi_square).epsilon(1e-6));
  const auto again = reversed(reversed(edges[0]));
  CHECK(test::difference(again.transform, edges[0].transform) < 1e-14);
  CHECK((again.information - edges[0].information).norm() < 1e-12);
  CHECK(again.source == edges[0].source);
}

TEST_CASE_TEMPLATE("turns of nearly half a circle are no trouble", T, test::d2, test::d3) {
  constexpr int D = T::static_dimension;
  for (const double degrees : {90.0, 179.0, 179.9999}) {
    // Nodes that are turned about z by that much, each with respect to the one before.
    std::vector<pose_of<D>> truth{pose_of<D>::Identity()};
    for (int i = 0; i < 5; ++i) {
      auto step = pose_of<D>::Identity();
      const double a = degrees * std::numbers::pi / 180;
      step.linear().template topLeftCorner<2, 2>() << std::cos(a), -std::sin(a), std::sin(a),
          std::cos(a);
      step.translation()[0] = 1;
      truth.push_back(truth.back() * step);
    }
    const auto edges = loop<D>(truth, 0);
    const auto found = optimize_poses(disturbed<D>(truth, 0.1), edges);
    CHECK(found.converged());
    CHECK(worst(found.poses, truth) < 1e-9);
    // Even from where the first edge is off by that angle.
    auto start = truth;
    start[1].linear() = truth[0].linear();
    const auto turned = optimize_poses(start, edges);
    CHECK(turned.converged());
    CHECK(worst(turned.poses, truth) < 1e-8);
  }
}

TEST_CASE_TEMPLATE("one false edge of twenty is named", T, test::d2, test::d3) {
  constexpr int D = T::static_dimension;
  const auto truth = random_poses<D>(13);
  auto edges = loop<D>(truth, 0.01);
  REQUIRE(edges.size() == 18);
  edges.push_back(measured<D>(truth, 9, 2, noise<D>(900, 0.01)));
  edges.push_back(measured<D>(truth, 11, 4));
  edges.back().transform = test::random_rigid<space_of<D>>(77, 1, 3);
  for (auto& edge : edges) edge.information *= 1e4;  // Of errors of 0.01.
  const auto start = poses_from_edges(13, edges);
  const auto right =
      optimize_poses(start, std::vector<pose_edge<D>>(edges.begin(), edges.end() - 1));
  for (const robust_kernel& kernel :
       {robust_kernel{huber{3}}, robust_kernel{geman_mcclure{3}}, robust_kernel{tukey{8}},
        robust_kernel{cauchy{3}}, robust_kernel{welsch{5}}}) {
    const auto found = optimize_poses(start, edges, {.robust = kernel});
    CHECK(found.converged());
    CHECK(found.rejected() == std::vector<index_t>{19});
    CHECK(found.edges[19].weight == 0);
    CHECK(found.edges[19].chi_square > found.chi_square_limit);
    CHECK(found.cost <= found.cost_at_start);
    CHECK(worst(found.poses, truth) < 0.1);
    CHECK(worst(found.poses, right.poses) < 0.02);
    std::ostringstream text;
    text << found;
    CHECK(text.str().find("edge 19 from 11 to 4 rejected: chi-square") != std::string::npos);
  }
  // Without a kernel it spoils all; and so it does if it is trusted.
  const auto spoilt = optimize_poses(start, edges);
  CHECK(spoilt.rejected().empty());
  CHECK(worst(spoilt.poses, truth) > 0.2);
  edges.back().trusted = true;
  const auto believed = optimize_poses(start, edges, {.robust = geman_mcclure{3}});
  CHECK(believed.edges.back().verdict == edge_verdict::kept);
  CHECK(believed.edges.back().weight == 1);
}

TEST_CASE_TEMPLATE("false edges from a spoilt start are named while the odometry is trusted", T,
                   test::d2, test::d3) {
  constexpr int D = T::static_dimension;
  const auto truth = random_poses<D>(40);
  auto edges = loop<D>(truth, 0.01);
  for (index_t e = 0; e + 1 < 40; ++e) edges[e].trusted = true;
  for (index_t i = 0; i < 8; ++i) {
    edges.push_back({.source = 39 - i, .target = 2 * i});
    edges.back().transform = test::random_rigid<space_of<D>>(std::uint64_t(700 + i), 1, 3);
  }
  for (auto& edge : edges) edge.information *= 1e4;
  std::vector<index_t> wrong;
  for (index_t e = std::ssize(edges) - 8; e < std::ssize(edges); ++e) wrong.push_back(e);
  const auto found = optimize_poses(poses_from_edges(40, edges), edges, {.robust = huber{3}});
  CHECK(found.converged());
  CHECK(found.rejected() == wrong);
  CHECK(worst(found.poses, truth) < 0.2);
}

TEST_CASE_TEMPLATE("components that nothing connects keep their places", T, test::d2, test::d3) {
  constexpr int D = T::static_dimension;
  const auto truth = random_poses<D>(9);
  std::vector<pose_edge<D>> edges;
  for (const auto& [source, target] : {std::pair{2, 0}, {4, 2}, {4, 0}, {3, 1}, {5, 3}, {5, 1}})
    edges.push_back(measured<D>(truth, source, target));
  // Nodes 6 and 7 have an edge that says nothing, 8 has none.
  edges.push_back(measured<D>(truth, 7, 6));
  edges.back().information.setZero();
  const auto start = disturbed<D>(truth, 0.1);
  const auto found = optimize_poses(start, edges);
  CHECK(found.status == pose_graph_status::disconnected);
  CHECK(!found.converged());
  CHECK(found.components == 5);
  CHECK(found.component_of == index_list{0, 1, 0, 1, 0, 1, 2, 3, 4});
  CHECK(found.undetermined == 0);
  CHECK(found.edges[6].verdict == edge_verdict::silent);
  CHECK(found.cost < 1e-20);
  for (const std::size_t stays : {0, 1, 6, 7, 8})
    CHECK(test::difference(found.poses[stays], start[stays]) == 0);
  // Where each has a fixed node, nothing is left open.
  const auto held = optimize_poses(start, edges, {.fixed = {4, 5, 6, 7, 8}});
  CHECK(held.converged());
  for (const std::size_t stays : {4, 5})
    CHECK(test::difference(held.poses[stays], start[stays]) == 0);
  CHECK(test::difference(held.poses[0], start[0]) > 1e-3);
  const auto partly = optimize_poses(start, edges, {.fixed = {4}});
  CHECK(partly.status == pose_graph_status::disconnected);
}

TEST_CASE("two edges that contradict each other leave what they connect apart") {
  const auto truth = random_poses<3>(4);
  std::vector<pose_edge<3>> edges{measured<3>(truth, 1, 0), measured<3>(truth, 3, 2),
                                  measured<3>(truth, 2, 0), measured<3>(truth, 3, 1)};
  edges[0].trusted = edges[1].trusted = true;
  edges[3].transform.translation().x() += 50;
  const auto start = disturbed<3>(truth, 0.01);
  const auto found = optimize_poses(start, edges, {.robust = tukey{3}});
  CHECK(found.cost <= found.cost_at_start);
  CHECK(found.rejected().size() >= 1);
  if (found.components == 2) CHECK(test::difference(found.poses[2], start[2]) < 1e-12);
}

TEST_CASE("directions that edges do not determine stay as the odometry says") {
  // A floor in sight of every scan: height, roll and pitch are measured, the rest is not.
  const auto truth = random_poses<3>(8, 0.3);
  std::vector<pose_edge<3>> edges;
  const Eigen::Vector3d up{0.3, -0.5, 0.8};
  for (index_t i = 0; i < 8; ++i)
    for (const index_t next : {i + 1, i + 2}) {
      if (next >= 8) continue;
      edges.push_back(measured<3>(truth, next, i));
      // In the target's coordinates: turns about the vertical, and ways along the floor.
      const Eigen::Vector3d n = (truth[i].linear().transpose() * up).normalized();
      Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - n * n.transpose();
      edges.back().information.setZero();
      edges.back().information.topLeftCorner<3, 3>() = 100 * across;
      edges.back().information.bottomRightCorner<3, 3>() = 1000 * n * n.transpose();
    }
  // The start is off in height and tilt only: it slides along no floor.
  auto start = truth;
  const Eigen::Vector3d vertical = up.normalized();
  for (index_t i = 1; i < 8; ++i) start[i].translation() += 0.01 * double(i) * vertical;
  const auto found = optimize_poses(start, edges);
  CHECK(found.status == pose_graph_status::degenerate);
  CHECK(found.undetermined == 7 * 3);
  CHECK(found.components == 1);
  CHECK(found.cost < 1e-12);
  for (std::size_t i = 0; i < 8; ++i) {
    const Eigen::Vector3d moved = found.poses[i].translation() - start[i].translation();
    CHECK((moved - vertical * vertical.dot(moved)).norm() < 1e-5);
    CHECK(test::difference(found.poses[i], truth[i]) < 1e-5);
  }
  // An odometry that drifts along these directions only decides alone about them.
  auto with_odometry = edges;
  for (index_t i = 0; i + 1 < 8; ++i) {
    const Eigen::Vector3d n = (truth[i].linear().transpose() * up).normalized();
    Eigen::VectorXd drift = noise<3>(std::uint64_t(i), 0.05);
    drift.head<3>() = n * n.dot(drift.head<3>());
    drift.tail<3>() -= n * n.dot(drift.tail<3>());
    with_odometry.push_back(measured<3>(truth, i + 1, i, drift));
    with_odometry.back().information *= 1e-3;
  }
  const auto all = optimize_poses(start, with_odometry);
  CHECK(all.converged());
  CHECK(all.undetermined == 0);
  const auto way =
      poses_from_edges(8, std::vector<pose_edge<3>>(with_odometry.end() - 7, with_odometry.end()));
  CHECK(worst(way, truth) > 0.1);
  CHECK(worst(all.poses, way) < 1e-6);
}

TEST_CASE("what align finds goes in as an edge, and what it does not see says nothing") {
  // A corridor: nothing tells how far along it a scan is, nor across in height.
  const auto wall = [](double height, double up) {
    point_cloud<double, 3> cloud{.points = Eigen::Matrix3Xd(3, 400),
                                 .normals = Eigen::Vector3d{0, 0, up}.replicate(1, 400)};
    for (index_t i = 0; i < 400; ++i)
      cloud.points.col(i) << 0.1 * double(i % 40), 0.1 * double(i / 40), height;
    return cloud;
  };
  const auto corridor = append(wall(0, 1), wall(1, -1));
  auto shifted = corridor;
  shifted.points.row(2).array() += 0.01;
  const auto found = align(shifted, corridor, {.max_distance = 0.5});
  REQUIRE(found.undetermined == 3);
  const auto edge = pose_edge_of(found, {.source = 1, .target = 0});
  CHECK(edge.source == 1);
  CHECK(edge.information.allFinite());
  CHECK((edge.information * found.unobservable_directions()).norm() <
        1e-9 * edge.information.norm());
  const auto graph = optimize_poses(2, std::vector{edge});
  CHECK(graph.status == pose_graph_status::degenerate);
  CHECK(graph.undetermined == 3);
  CHECK(test::difference(graph.poses[1], found.transform) < 1e-12);

  // In a room of known noise, the information is that of the fit.
  const auto surface = test::bumpy_surface<test::d3>(500);
  const auto seen = align(surface, surface, {.max_distance = 0.5});
  const auto exact = pose_edge_of(seen, {.source = 0, .target = 1});
  CHECK(exact.information.allFinite());
  CHECK(exact.information.norm() > 0);
  const auto noisy =
      pose_edge_of(seen, {.source = 0, .target = 1, .noise = 0.1, .independent_pairs = 1e9});
  CHECK((noisy.information - seen.information / 0.01).norm() < 1e-9 * noisy.information.norm());
  const auto few =
      pose_edge_of(seen, {.source = 0, .target = 1, .noise = 0.1, .independent_pairs = 50});
  CHECK((few.information * 10 - noisy.information).norm() < 1e-9 * noisy.information.norm());
  CHECK(optimize_poses(2, std::vector{noisy}).converged());

  // No pairs, no information.
  auto far = surface;
  far.points.array() += 100;
  const auto nothing =
      pose_edge_of(align(far, surface, {.max_distance = 1}), {.source = 0, .target = 1});
  CHECK(nothing.information.isZero(0));
  // In float and in the plane.
  const auto flat = test::bumpy_surface<test::f2>(100);
  const auto planar =
      pose_edge_of(align(flat, flat, {.max_distance = 1}), {.source = 0, .target = 1});
  CHECK(planar.information.rows() == 3);
}

TEST_CASE(
    "a sphere of two thousand nodes comes back, with the same bits on any number of threads") {
  constexpr index_t rings = 40, around = 50;
  std::vector<pose_of<3>> truth;
  for (index_t r = 0; r < rings; ++r)
    for (index_t k = 0; k < around; ++k) {
      const double a = 2 * std::numbers::pi * double(k) / double(around);
      const double h = -0.9 + 1.8 * double(r) / double(rings - 1), w = std::sqrt(1 - h * h);
      const Eigen::Vector3d out{w * std::cos(a), w * std::sin(a), h};
      const Eigen::Vector3d along{-std::sin(a), std::cos(a), 0};
      pose_of<3> pose = pose_of<3>::Identity();
      pose.linear() << out, along, out.cross(along);
      pose.translation() = 10 * out;
      truth.push_back(pose);
    }
  std::vector<pose_edge<3>> edges;
  for (index_t i = 0; i + 1 < std::ssize(truth); ++i) {
    edges.push_back(measured<3>(truth, i + 1, i, noise<3>(std::uint64_t(i), 0.005)));
    edges.back().trusted = true;
  }
  for (index_t i = 0; i + around < std::ssize(truth); ++i)
    edges.push_back(measured<3>(truth, i + around, i, noise<3>(std::uint64_t(100'000 + i), 0.005)));
  for (auto& edge : edges) edge.information /= 0.005 * 0.005;
  std::vector<pose_of<3>> start{pose_of<3>::Identity()};
  start[0] = truth[0];
  for (index_t i = 0; i + 1 < std::ssize(truth); ++i)
    start.push_back(start.back() * edges[i].transform);
  CHECK(worst(start, truth) > 1);
  const auto found = optimize_poses(start, edges, {.threads = 1});
  CHECK(found.converged());
  CHECK(found.iterations < 15);
  CHECK(worst(found.poses, truth) < 0.4);
  // As many chi-squares as edges, less what the poses take up.
  const double expected = 6 * (double(edges.size()) - double(truth.size()) + 1);
  CHECK(found.cost == doctest::Approx(expected).epsilon(0.05));
  const auto others = optimize_poses(start, edges, {.threads = 4});
  for (std::size_t i = 0; i < truth.size(); ++i)
    CHECK(test::same_bits(found.poses[i].matrix(), others.poses[i].matrix()));
  CHECK(found.cost == others.cost);
}

TEST_CASE_TEMPLATE("small graphs", T, test::d2, test::d3) {
  constexpr int D = T::static_dimension;
  const auto none = optimize_poses(std::vector<pose_of<D>>{}, {});
  CHECK(none.converged());
  CHECK(none.components == 0);
  const auto alone = optimize_poses(std::vector<pose_of<D>>{pose_of<D>::Identity()}, {});
  CHECK(alone.converged());
  CHECK(alone.components == 1);
  const auto apart = optimize_poses(random_poses<D>(3), {});
  CHECK(apart.status == pose_graph_status::disconnected);
  CHECK(apart.components == 3);
  CHECK(poses_from_edges<D>(0, {}).empty());
  CHECK(poses_from_edges<D>(2, {}).size() == 2);
  // Two edges between the same nodes: the mean.
  std::vector<pose_edge<D>> two(2, {.source = 1, .target = 0});
  two[1].transform.translation()[0] = 1;
  two[1].information *= 3;
  CHECK(optimize_poses(2, two).poses[1].translation()[0] == doctest::Approx(0.75));
  // Far from the world's origin.
  const auto truth = random_poses<D>(5);
  auto away = truth;
  for (auto& pose : away) pose.translation().array() += 1e6;
  const auto found = optimize_poses(disturbed<D>(away, 0.1), loop<D>(truth, 0));
  CHECK(found.converged());
  CHECK(worst(found.poses, away) < 1e-7);
}

TEST_CASE("the tree of the start follows what says most, and trusted edges first") {
  std::vector<pose_edge<2>> edges(3, {.source = 1, .target = 0});
  for (std::size_t e = 0; e < 3; ++e) edges[e].transform.translation().x() = double(e + 1);
  edges[1].information *= 2;
  edges[2].information *= 100;
  edges[2].information.row(0).setZero();
  edges[2].information.col(0).setZero();
  CHECK(poses_from_edges(2, edges)[1].translation().x() == 2);
  edges[2].trusted = true;
  CHECK(poses_from_edges(2, edges)[1].translation().x() == 3);
}

TEST_CASE("what makes no sense is refused") {
  const auto truth = random_poses<3>(4);
  const auto edges = loop<3>(truth, 0);
  const auto refused = [&](const auto& change) {
    auto wrong = edges;
    change(wrong[1]);
    CHECK_THROWS_AS((void)optimize_poses(truth, wrong), invalid_input);
    CHECK_THROWS_AS((void)poses_from_edges(4, wrong), invalid_input);
  };
  refused([](auto& e) { e.source = 4; });
  refused([](auto& e) { e.target = -1; });
  refused([](auto& e) { e.target = e.source; });
  refused([](auto& e) { e.transform.translation().x() = test::nan<double>; });
  refused([](auto& e) { e.transform.linear() *= 2; });
  refused([](auto& e) { e.transform.linear().col(0) *= -1; });
  refused([](auto& e) { e.information(0, 0) = test::nan<double>; });
  refused([](auto& e) { e.information(0, 0) = test::infinity<double>; });
  refused([](auto& e) { e.information(0, 1) = 0.5; });
  refused([](auto& e) { e.information(2, 2) = -1; });
  refused([](auto& e) { e.information(0, 1) = e.information(1, 0) = 2; });
  CHECK_THROWS_WITH((void)optimize_poses(truth, std::vector<pose_edge<3>>(1)),
                    "pose graph: edge 0 (from node -1 to node -1) names a node that there is not; "
                    "there are 4");
  auto flat = edges[0];
  CHECK_THROWS_AS((flat.information = Eigen::MatrixXd::Identity(3, 3)), invalid_input);
  auto poses = truth;
  poses[2].translation().z() = test::infinity<double>;
  CHECK_THROWS_AS((void)optimize_poses(poses, edges), invalid_input);
  CHECK_THROWS_AS((void)optimize_poses(truth, edges, {.fixed = {4}}), invalid_input);
  CHECK_THROWS_AS((void)optimize_poses(truth, edges, {.min_weight = 2}), invalid_input);
  CHECK_THROWS_AS((void)optimize_poses(truth, edges, {.max_iterations = -1}), invalid_input);
  CHECK_THROWS_AS((void)optimize_poses(truth, edges, {.tolerance = -1}), invalid_input);
  CHECK_THROWS_AS((void)optimize_poses(truth, edges, {.threads = -1}), invalid_input);
  const robust_kernel bad{[](double) { return -1.0; }};
  CHECK_THROWS_AS((void)optimize_poses(truth, edges, {.robust = bad}), invalid_input);
  CHECK_THROWS_AS((void)poses_from_edges<3>(-1, {}), invalid_input);
}

TEST_CASE("a stop and a limit leave poses that are no worse") {
  const auto truth = random_poses<3>(10);
  const auto edges = loop<3>(truth, 0.02);
  const auto start = disturbed<3>(truth, 0.2);
  const auto limited = optimize_poses(start, edges, {.max_iterations = 1});
  CHECK(limited.status == pose_graph_status::iteration_limit);
  CHECK(limited.iterations == 1);
  CHECK(limited.cost < limited.cost_at_start);
  CHECK(optimize_poses(start, edges, {.max_iterations = 0}).cost == limited.cost_at_start);

  std::stop_source source;
  std::vector<double> shares;
  const auto seen =
      optimize_poses(start, edges, {.monitor = {[&](double s) { shares.push_back(s); }}});
  CHECK(seen.converged());
  CHECK(std::ranges::is_sorted(shares));
  CHECK(shares.back() == 1);
  const auto stopped = optimize_poses(
      start, edges, {.monitor = {[&](double) { source.request_stop(); }, source.get_token()}});
  CHECK(stopped.status == pose_graph_status::cancelled);
  CHECK(stopped.cost <= stopped.cost_at_start);
  CHECK(stopped.poses.size() == start.size());
}
