// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <vector>

#include <doctest/doctest.h>

#include "spaces.hpp"
import cilantro;
import test_support;

using namespace cilantro;

namespace {

template <int D>
double volume_of(const point_matrix<double, D>& points, const auto& simplex) {
  Eigen::MatrixXd arms(D, D);
  for (int k = 0; k < D; ++k) arms.col(k) = points.col(simplex[k + 1]) - points.col(simplex[0]);
  return determinant(arms) / (D == 2 ? 2 : 6);
}

/// How far inside the sphere through the corners of a simplex the nearest point is, in units of its
/// radius; by a linear system, apart from the library's way.
template <int D>
double deepest_in_sphere(const point_matrix<double, D>& points, const auto& simplex) {
  Eigen::MatrixXd a(D, D);
  Eigen::VectorXd b(D);
  const Eigen::VectorXd first = points.col(simplex[0]);
  for (int k = 0; k < D; ++k) {
    const Eigen::VectorXd arm = points.col(simplex[k + 1]) - first;
    a.row(k) = 2 * arm.transpose();
    b[k] = arm.squaredNorm();
  }
  const auto solved = solve(a, b);
  if (!solved) return 0;
  const Eigen::VectorXd center = first + solved->col(0);
  const double radius = solved->col(0).norm();
  double deepest = 0;
  for (index_t i = 0; i < points.cols(); ++i)
    deepest = std::max(deepest, 1 - (points.col(i) - center).norm() / radius);
  return deepest;
}

template <int D>
void expect_triangulation(const point_matrix<double, D>& points, const triangulation<D>& mesh,
                          double rounding) {
  double sum = 0, least = 1, deepest = 0;
  index_t wrong_neighbors = 0;
  for (index_t s = 0; s < mesh.simplices.cols(); ++s) {
    const auto simplex = mesh.simplices.col(s);
    const double volume = volume_of<D>(points, simplex);
    least = std::min(least, volume);
    sum += volume;
    deepest = std::max(deepest, deepest_in_sphere<D>(points, simplex));
    for (int k = 0; k <= D; ++k) {
      const auto other = mesh.neighbors(k, s);
      if (other < 0) continue;
      index_t shared = 0;
      for (int j = 0; j <= D; ++j)
        shared += j != k && (mesh.simplices.col(other).array() == simplex[j]).any();
      wrong_neighbors += shared != D || (mesh.neighbors.col(other).array() != s).all();
    }
  }
  CHECK(least >= -rounding);
  CHECK(sum == doctest::Approx(convex_hull(points).volume()).epsilon(1e-9));
  CHECK(deepest <= rounding);
  CHECK(wrong_neighbors == 0);
}

/// A regular grid, in which many points lie on one circle or sphere.
template <int D>
point_matrix<double, D> grid(int side) {
  const index_t count = index_t(std::pow(side, D) + 0.5);
  point_matrix<double, D> points(D, count);
  for (index_t i = 0; i < count; ++i)
    for (index_t d = 0, rest = i; d < D; ++d, rest /= side) points(d, i) = double(rest % side);
  return points;
}

}  // namespace

TEST_CASE("no point is inside the circle or sphere of a Delaunay simplex, and they fill the hull") {
  const point_matrix<double, 2> plane = test::random_points<test::d2>(400, 1);
  const auto flat = delaunay_triangulation(plane);
  expect_triangulation<2>(plane, flat, 1e-9);
  // Euler: 2 N - 2 - the corners of the hull.
  CHECK(flat.simplices.cols() == 2 * 400 - 2 - convex_hull(plane).vertices().size());
  const point_matrix<double, 3> space = test::random_points<test::d3>(300, 2);
  expect_triangulation<3>(space, delaunay_triangulation(space), 1e-8);
  const point_matrix<double, 3> far = space.array() + 1000;
  expect_triangulation<3>(far, delaunay_triangulation(far), 1e-7);
}

TEST_CASE("points of a grid, many on one sphere, are triangulated without slivers") {
  const auto squares = grid<2>(9);
  const auto flat = delaunay_triangulation(squares);
  expect_triangulation<2>(squares, flat, 1e-9);
  CHECK(flat.simplices.cols() == 2 * 8 * 8);
  const auto cubes = grid<3>(5);
  const auto mesh = delaunay_triangulation(cubes);
  expect_triangulation<3>(cubes, mesh, 1e-9);
  for (index_t s = 0; s < mesh.simplices.cols(); ++s)
    CHECK(volume_of<3>(cubes, mesh.simplices.col(s)) > 0.1);
  CHECK(delaunay_triangulation(cubes).simplices == mesh.simplices);
  // All on one circle or sphere.
  CHECK(delaunay_triangulation(grid<2>(2)).simplices.cols() == 2);
  expect_triangulation<3>(grid<3>(2), delaunay_triangulation(grid<3>(2)), 1e-9);
}

TEST_CASE(
    "what has no triangles: few points, points on a line or in a plane, none that is finite") {
  CHECK(delaunay_triangulation(Eigen::Matrix2Xd(2, 0)).simplices.cols() == 0);
  CHECK(delaunay_triangulation(Eigen::Matrix2Xd{Eigen::Matrix2d::Identity()}).simplices.cols() ==
        0);
  Eigen::Matrix2Xd line(2, 9);
  for (int i = 0; i < 9; ++i) line.col(i) << i, 2 * i;
  CHECK(delaunay_triangulation(line).simplices.cols() == 0);
  CHECK(delaunay_triangulation(line).left_out == 9);
  Eigen::Matrix3Xf plane = Eigen::Matrix3Xf::Zero(3, 25);
  for (int i = 0; i < 25; ++i) plane.col(i) << float(i % 5), float(i / 5), 2;
  CHECK(delaunay_triangulation(plane).simplices.cols() == 0);
  Eigen::Matrix2Xf mixed(2, 6);
  mixed << 0, 1, 1, test::nan<float>, 0, 1, 0, 0, 1, 2, 1, 1;
  const auto mesh = delaunay_triangulation(mixed);
  CHECK(mesh.simplices.cols() == 2);
  CHECK(mesh.non_finite == 1);
  CHECK(mesh.left_out == 1);
  CHECK((mesh.simplices.array() != 5).all());
  CHECK_THROWS_AS((void)delaunay_triangulation(Eigen::Matrix4Xd(4, 9)), invalid_input);
  const Eigen::Matrix2Xd same = Eigen::Vector2d{1e300, -1e300}.replicate(1, 50);
  CHECK(delaunay_triangulation(same).simplices.cols() == 0);
}

TEST_CASE(
    "nearly equal points and far ones give a right triangulation or an error, and never hang") {
  index_t errors = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    random_stream random{seed};
    Eigen::Matrix2Xd points(2, 120);
    for (int i = 0; i < 60; ++i) {
      points.col(2 * i) << random.uniform(-1, 1), random.uniform(-1, 1);
      for (int d = 0; d < 2; ++d)
        points(d, 2 * i + 1) = points(d, 2 * i) + 1e-12 * random.uniform(-1, 1);
    }
    if (seed % 2 == 1) points.col(0) *= std::pow(10.0, double(seed % 11));
    try {
      const auto found = concave_hull(points, {.alpha = 1e9});
      double by_rings = 0;
      for (const auto& ring : found.rings)
        for (std::size_t k = 0; k < ring.size(); ++k) {
          const Eigen::Vector2d a = points.col(ring[k]);
          const Eigen::Vector2d b = points.col(ring[(k + 1) % ring.size()]);
          by_rings += (a[0] * b[1] - a[1] * b[0]) / 2;
        }
      CHECK(by_rings == doctest::Approx(found.area));
    } catch (const std::runtime_error&) {
      ++errors;
    }
  }
  CHECK(errors < 60);
}

TEST_CASE("points of any size are triangulated, and what floats make of a plane is none") {
  const Eigen::Matrix2Xd points = test::random_points<test::d2>(30, 5);
  const double all = std::numeric_limits<double>::infinity();
  const auto plain = concave_hull(points, {.alpha = 0.4});
  CHECK(plain.triangles.cols() > 0);
  CHECK(plain.triangles.cols() < concave_hull(points, {.alpha = all}).triangles.cols());
  for (const double scale : {1e-300, 1e-120, 1e105, 1e300}) {
    const Eigen::Matrix2Xd sized = points * scale;
    CHECK(concave_hull(sized, {.alpha = 0.4 * scale}).triangles.cols() == plain.triangles.cols());
    CHECK(delaunay_triangulation(sized).simplices.cols() ==
          delaunay_triangulation(points).simplices.cols());
  }
  const Eigen::Matrix2Xd too_far{{-1.5e308, 1.5e308, 0}, {0, 0, 1}};
  CHECK(delaunay_triangulation(too_far).simplices.cols() == 0);
  Eigen::Matrix3Xf plane(3, 400);
  Eigen::Matrix2Xf line(2, 50);
  for (int i = 0; i < 400; ++i) {
    const float x = float(i % 20) * 0.1f, y = float(i / 20) * 0.1f;
    plane.col(i) << x, y, 0.3f * x + 0.7f * y;
  }
  for (int i = 0; i < 50; ++i) line.col(i) << 0.1f * float(i), 0.37f * float(i);
  CHECK(delaunay_triangulation(plane).simplices.cols() == 0);
  CHECK(delaunay_triangulation(line).simplices.cols() == 0);
}

TEST_CASE("the concave hull of a ring has an outline and a hole, and knows what it covers") {
  // Points between two circles.
  random_stream random{4};
  std::vector<Eigen::Vector2d> kept;
  while (kept.size() < 4000) {
    const Eigen::Vector2d p{random.uniform(-1, 1), random.uniform(-1, 1)};
    if (p.norm() <= 1 && p.norm() >= 0.5) kept.push_back(p);
  }
  Eigen::Matrix2Xd points(2, 4000);
  for (int i = 0; i < 4000; ++i) points.col(i) = kept[i];
  const auto found = concave_hull(points, {.alpha = 0.1});
  REQUIRE(found.rings.size() == 2);
  CHECK(found.area == doctest::Approx(0.75 * std::numbers::pi).epsilon(0.04));
  CHECK(found.left_out == 0);
  // The signed areas of the rings add up to what the triangles cover.
  double by_rings = 0;
  std::vector<double> areas;
  for (const auto& ring : found.rings) {
    double area = 0;
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const Eigen::Vector2d a = points.col(ring[k]), b = points.col(ring[(k + 1) % ring.size()]);
      area += (a[0] * b[1] - a[1] * b[0]) / 2;
    }
    CHECK(ring[0] == *std::ranges::min_element(ring));
    areas.push_back(area);
    by_rings += area;
  }
  CHECK(by_rings == doctest::Approx(found.area).epsilon(1e-12));
  CHECK(std::ranges::min(areas) < 0);

  const auto convex = concave_hull(points, {.alpha = std::numeric_limits<double>::infinity()});
  CHECK(convex.rings.size() == 1);
  CHECK(convex.area == doctest::Approx(convex_hull(points).volume()));
  CHECK(convex.perimeter == doctest::Approx(convex_hull(points).area()));
  CHECK(concave_hull(points, {.alpha = 1e-9}).rings.empty());
  CHECK(concave_hull(points, {.alpha = 1e-9}).left_out == 4000);

  // The same in a plane of space, far from the origin and in float.
  Eigen::Matrix3Xf tilted(3, 4001);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd{0.7, Eigen::Vector3d{1, 2, 3}.normalized()}.matrix();
  for (int i = 0; i < 4000; ++i)
    tilted.col(i) = (turn * Eigen::Vector3d{points(0, i), points(1, i), 5}).cast<float>();
  tilted.col(4000).setConstant(test::nan<float>);
  const auto in_space = concave_hull(tilted, {.alpha = 0.1, .tolerance = 1e-3});
  CHECK(in_space.rings.size() == 2);
  CHECK(in_space.area == doctest::Approx(found.area).epsilon(1e-4));
  CHECK(in_space.non_finite == 1);
  CHECK((in_space.normal - turn.col(2)).norm() < 1e-5);
  CHECK(in_space.offset == doctest::Approx(5).epsilon(1e-5));
  CHECK(in_space.thickness < 1e-5);
}

TEST_CASE("triangles that touch in a corner have outlines of their own") {
  Eigen::Matrix2Xd points(2, 5);
  points << -1, -1, 0, 1, 1, -0.5, 0.5, 0, -0.5, 0.5;
  const auto found = concave_hull(points, {.alpha = 0.65});
  CHECK(found.triangles.cols() == 2);
  CHECK(found.rings == std::vector<index_list>{{0, 2, 1}, {2, 3, 4}});
}

TEST_CASE("concave hulls say what they cannot do") {
  const Eigen::Matrix2Xd plane = Eigen::Matrix2Xd::Zero(2, 3);
  CHECK_THROWS_AS((void)concave_hull(plane, {.alpha = 0}), invalid_input);
  CHECK_THROWS_AS((void)concave_hull(plane, {.alpha = test::nan<double>}), invalid_input);
  CHECK_THROWS_AS((void)concave_hull(plane, {.alpha = 1, .tolerance = 1}), invalid_input);
  const auto space = test::random_points<test::d3>(20, 1);
  CHECK_THROWS_AS((void)concave_hull(space, {.alpha = 1}), invalid_input);
  CHECK_THROWS_WITH_AS((void)concave_hull(space, {.alpha = 1, .tolerance = 1e-3}),
                       doctest::Contains("concave_hull: a point is"), invalid_input);
  CHECK(concave_hull(plane, {.alpha = 1}).rings.empty());
}
