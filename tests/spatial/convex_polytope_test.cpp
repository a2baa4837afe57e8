// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <ranges>
#include <vector>

#include <doctest/doctest.h>

#include "spaces.hpp"
import cilantro;
import test_support;

using namespace cilantro;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// A rotation of any dimension.
Eigen::MatrixXd rotation(index_t d, std::uint64_t seed) {
  random_stream random{seed};
  Eigen::MatrixXd m(d, d);
  for (index_t i = 0; i < d; ++i) {
    for (index_t j = 0; j < d; ++j) m(j, i) = random.uniform(-1, 1);
    for (index_t k = 0; k < i; ++k) m.col(i) -= m.col(k).dot(m.col(i)) * m.col(k);
    m.col(i).normalize();
  }
  return m;
}

/// A box with the given half-widths, turned and moved, as half-spaces.
struct turned_box {
  Eigen::MatrixXd normals;
  Eigen::VectorXd offsets;
};
turned_box box_at(const Eigen::VectorXd& center, const Eigen::VectorXd& half,
                  const Eigen::MatrixXd& turn) {
  const index_t d = center.size();
  turned_box box{Eigen::MatrixXd(d, 2 * d), Eigen::VectorXd(2 * d)};
  for (index_t k = 0; k < d; ++k) {
    box.normals.col(2 * k) = turn.col(k);
    box.normals.col(2 * k + 1) = -turn.col(k);
    box.offsets[2 * k] = turn.col(k).dot(center) + half[k];
    box.offsets[2 * k + 1] = -turn.col(k).dot(center) + half[k];
  }
  return box;
}

}  // namespace

TEST_CASE("boxes of half-spaces are right wherever they are and however thin") {
  for (const index_t d : {2, 3, 4})
    for (const double away : {0.0, 1.0, 1e3, 1e6, 1e9})
      for (const double thickness : {1.0, 1e-3, 1e-6, 1e-9})
        for (const bool turned : {false, true}) {
          CAPTURE(d);
          CAPTURE(away);
          CAPTURE(thickness);
          CAPTURE(turned);
          const Eigen::MatrixXd turn =
              turned ? rotation(d, 3) : Eigen::MatrixXd{Eigen::MatrixXd::Identity(d, d)};
          Eigen::VectorXd half = Eigen::VectorXd::Constant(d, 0.5);
          half[0] *= thickness;
          const Eigen::VectorXd center = Eigen::VectorXd::Constant(d, away / 3);
          const auto from = box_at(center, half, turn);
          const auto found = intersect_half_spaces(from.normals, from.offsets);
          CHECK(!found.empty());
          // What the offsets themselves can say.
          const double resolution = (away + (turned ? 1 : 0)) * 1e-15;
          if (thickness > 1e3 * resolution) {
            REQUIRE(found.status() == polytope_status::bounded);
            CHECK(found.vertices().size() == index_t{1} << d);
            CHECK(found.facets().size() == 2 * d);
            CHECK(std::abs(found.volume() - thickness) <= 1e-9 * thickness + 8 * resolution);
            const auto ball = found.interior_ball();
            REQUIRE(ball);
            CHECK(std::abs(ball->radius - thickness / 2) <= 1e-9 * thickness + 8 * resolution);
          }
          CHECK(found.contains(center));
        }
}

TEST_CASE("half-spaces that contradict each other have the empty set, by however little") {
  for (const double gap : {1.0, 1e-6, 1e-12}) {
    CAPTURE(gap);
    Eigen::MatrixXd normals(3, 2);
    normals << 1, -1, 0, 0, 0, 0;
    const auto none = intersect_half_spaces(normals, std::vector<double>{0, -gap});
    CHECK(none.status() == polytope_status::empty);
    CHECK(none.volume() == 0);
    CHECK(none.vertices().empty());
    CHECK_FALSE(none.interior_ball());
    CHECK_FALSE(none.centroid());
    CHECK_FALSE(none.contains(Eigen::Vector3d{0, 0, 0}));
  }
}

TEST_CASE("sets without end are sets as any other") {
  const auto whole = intersect_half_spaces(Eigen::MatrixXd(3, 0), {});
  CHECK(whole.status() == polytope_status::unbounded);
  CHECK(whole.volume() == infinity);
  CHECK(whole.contains(Eigen::Vector3d{1e9, 0, 0}));
  CHECK(whole.rays().size() == 6);
  CHECK(whole.facets().empty());

  const auto half =
      intersect_half_spaces(Eigen::MatrixXd{Eigen::Vector3d{0, 0, 2}}, std::vector<double>{4});
  CHECK(half.status() == polytope_status::unbounded);
  CHECK(half.facets().size() == 1);
  CHECK(half.contains(Eigen::Vector3d{5, 5, 2}));
  CHECK_FALSE(half.contains(Eigen::Vector3d{5, 5, 2.001}));
  CHECK(half.rays().size() == 5);
  CHECK_FALSE(half.interior_ball());  // Balls of any size fit.

  Eigen::MatrixXd slab(3, 2);
  slab << 0, 0, 0, 0, 1, -1;
  const auto between = intersect_half_spaces(slab, std::vector<double>{1, 1});
  CHECK(between.status() == polytope_status::unbounded);
  CHECK(between.interior_ball()->radius == doctest::Approx(1));
  CHECK(between.vertices().size() == 2);
  CHECK(between.rays().size() == 4);

  const auto octant = intersect_half_spaces(Eigen::MatrixXd{-Eigen::Matrix3d::Identity()},
                                            std::vector<double>{-1, -2, -3});
  CHECK(octant.status() == polytope_status::unbounded);
  REQUIRE(octant.vertices().size() == 1);
  CHECK((octant.vertices()[0] - Eigen::Vector3d{1, 2, 3}).norm() < 1e-12);
  REQUIRE(octant.rays().size() == 3);
  CHECK(octant.bounding_box().upper[0] == infinity);
  CHECK(octant.bounding_box().lower[2] == doctest::Approx(3));
  for (const auto facet : octant.facets()) {
    CHECK(facet.vertices.size() == 3);
    CHECK(facet.neighbors.size() == 2);
  }
  const auto opposite = intersect_half_spaces(Eigen::MatrixXd{Eigen::Matrix3d::Identity()},
                                              std::vector<double>{2, 4, 6});
  const auto both = octant & opposite;
  CHECK(both.status() == polytope_status::bounded);
  CHECK(both.volume() == doctest::Approx(1 * 2 * 3));
}

TEST_CASE("flat sets have their own dimension and measure") {
  for (const double away : {0.0, 1e6})
    for (const bool turned : {false, true}) {
      CAPTURE(away);
      CAPTURE(turned);
      const Eigen::Matrix3d turn =
          turned ? Eigen::Matrix3d{rotation(3, 5)} : Eigen::Matrix3d{Eigen::Matrix3d::Identity()};
      const Eigen::Vector3d center{away, -away, away / 2};
      const double slack = 1e-9 + away * 1e-14;
      for (const index_t extent : {0, 1, 2}) {
        CAPTURE(extent);
        Eigen::VectorXd half = Eigen::Vector3d::Zero();
        half.head(extent).setConstant(0.5);
        const auto from = box_at(center, half, turn);
        const auto found =
            intersect_half_spaces(from.normals, from.offsets, {.tolerance = away * 1e-14});
        CHECK(found.status() == polytope_status::flat);
        REQUIRE(found.affine_dimension() == extent);
        CHECK(found.measure() == doctest::Approx(1).epsilon(slack));
        CHECK(found.volume() == 0);
        CHECK(found.vertices().size() == index_t{1} << extent);
        CHECK(found.contains(center));
        CHECK_FALSE(found.contains(Eigen::Vector3d{center + 0.1 * turn.col(2)}));
        CHECK_FALSE(found.interior_ball());

        // The same from its corners.
        const auto hull = convex_hull(found.vertices(), {.tolerance = away * 1e-14});
        CHECK(hull.affine_dimension() == extent);
        CHECK(hull.measure() == doctest::Approx(1).epsilon(slack));
        CHECK(hull.contains(center));
        CHECK_FALSE(hull.contains(Eigen::Vector3d{center + 0.1 * turn.col(2)}));
      }
    }
}

TEST_CASE("boxes that share a face, an edge or a corner meet in a flat set") {
  const convex_polytope<3> a{box{{0, 0, 0}, {1, 1, 1}}};
  CHECK((a & convex_polytope<3>{box{{1, 0, 0}, {2, 1, 1}}}).affine_dimension() == 2);
  CHECK((a & convex_polytope<3>{box{{1, 1, 0}, {2, 2, 1}}}).affine_dimension() == 1);
  CHECK((a & convex_polytope<3>{box{{1, 1, 1}, {2, 2, 2}}}).affine_dimension() == 0);
  CHECK((a & convex_polytope<3>{box{{1.001, 1, 1}, {2, 2, 2}}}).empty());
}

TEST_CASE_TEMPLATE(
    "hulls contain their points, and have no bit of who culls or how many threads there are", T,
    ALL_SPACES) {
  using S = typename T::scalar;
  auto points = test::random_points<T>(T::dimension > 3 ? 300 : 5000, 7);
  points(0, 17) = test::nan<S>;
  points(1, 200) = test::infinity<S>;
  const auto hull = convex_hull(points, {.threads = 1});
  CHECK(hull.non_finite() == 2);
  CHECK(hull.status() == polytope_status::bounded);
  index_t outside = 0;
  for (index_t i = 0; i < points.cols(); ++i)
    outside += points.col(i).allFinite() && !hull.contains(points.col(i));
  CHECK(outside == 0);
  CHECK(std::ranges::is_sorted(hull.indices()));
  for (index_t v = 0; v < hull.vertices().size(); ++v)
    CHECK(test::same_bits(hull.vertices()[v],
                          points.col(hull.indices()[v]).template cast<double>().eval()));
  const auto in = hull.contains_each(points);
  CHECK(std::ranges::count(in, 1) == points.cols() - 2);

  for (const bool cull : {false, true})
    for (const int threads : {1, 2, 4}) {
      const auto again = convex_hull(points, {.cull = cull, .threads = threads});
      CHECK(std::ranges::equal(again.indices(), hull.indices()));
      CHECK(test::same_bits(again.normals().matrix(), hull.normals().matrix()));
      CHECK(std::ranges::equal(again.offsets(), hull.offsets()));
      CHECK(again.volume() == hull.volume());
    }
}

TEST_CASE("sets far away from where their half-spaces pass the origin are found") {
  Eigen::Matrix2Xd normals(2, 3);
  normals << 0, -1e-3, 2e-3, -1, 1, -1;
  const auto wedge =
      intersect_half_spaces(Eigen::Matrix2Xd{normals.leftCols(2)}, std::vector{-1.0, 0.0});
  CHECK(wedge.status() == polytope_status::unbounded);
  CHECK(wedge.contains(Eigen::Vector2d{2000, 1.5}));
  const auto triangle = intersect_half_spaces(normals, std::vector{-1.0, 0.0, 1.5});
  REQUIRE(triangle.status() == polytope_status::bounded);
  CHECK(triangle.vertices().size() == 3);
  CHECK(triangle.volume() == doctest::Approx(62.5));
  CHECK(triangle.contains(Eigen::Vector2d{1250, 1.1}));
  const auto above = intersect_half_spaces(Eigen::Matrix2Xd{normals.col(0)}, std::vector{-1.0});
  const auto below = intersect_half_spaces(Eigen::Matrix2Xd{normals.col(1)}, std::vector{0.0});
  CHECK_FALSE((above - below).contains(Eigen::Vector2d{5000, 2}));
}

TEST_CASE("half-spaces that are there to say nothing take nothing away") {
  for (const double far : {1e6, 1e13, 1e30}) {
    CAPTURE(far);
    const convex_polytope<3> layer{box{{-far, -far, 0}, {far, far, 1}}};
    CHECK(layer.affine_dimension() == 3);
    CHECK(layer.contains(Eigen::Vector3d{5, 5, 0.5}));
    if (far <= 1e6) CHECK_FALSE(layer.contains(Eigen::Vector3d{5, 5, 1.5}));
    Eigen::Matrix3Xd normals(3, 7);
    normals << Eigen::Matrix3d::Identity(), -Eigen::Matrix3d::Identity(), Eigen::Vector3d{1, 1, 1};
    const auto cube =
        intersect_half_spaces(normals, std::vector{1.0, 1.0, 1.0, 0.0, 0.0, 0.0, far});
    CHECK(cube.status() == polytope_status::bounded);
    CHECK(cube.volume() == doctest::Approx(1));
    CHECK(cube.facets().size() == 6);
    CHECK(cube.tolerance() < 1e-12);
  }
}

TEST_CASE("nothing that is not finite is inside, and nothing at all is in the empty set") {
  const convex_polytope<3> cube{box{{0, 0, 0}, {1, 1, 1}}};
  const auto whole = intersect_half_spaces(Eigen::Matrix3Xd(3, 0), {});
  for (const double bad : {infinity, -infinity, test::nan<double>})
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Vector3d p{0.5, 0.5, 0.5};
      p[axis] = bad;
      CHECK_FALSE(cube.contains(p));
      CHECK_FALSE(whole.contains(p));
      CHECK_THROWS_AS((void)cube.signed_distance(p), invalid_input);
      CHECK_THROWS_AS((void)cube.closest_point(p), invalid_input);
    }
  const convex_polytope<3> none;
  CHECK_FALSE(none.contains(Eigen::Vector3d{0, 0, 0}, 5));
  CHECK(none.contains_each(Eigen::Matrix3Xd{Eigen::Vector3d{0, 0, 0}}, 5)[0] == 0);
  CHECK((none & cube).empty());
  CHECK(none.signed_distance(Eigen::Vector3d{0, 0, 0}) == infinity);
}

TEST_CASE("distances and nearest points agree with those of a box") {
  const Eigen::Vector3d low{-1, 0, 2}, high{1, 3, 2.5};
  const convex_polytope<3> found{box{low, high}};
  const auto points = test::random_points<test::d3>(500, 4, -5, 5);
  for (index_t i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3d p = points.col(i), nearest = p.cwiseMax(low).cwiseMin(high);
    CHECK((found.closest_point(p) - nearest).norm() < 1e-9);
    const double inside = std::max((low - p).maxCoeff(), (p - high).maxCoeff());
    CHECK(found.signed_distance(p) ==
          doctest::Approx(inside <= 0 ? inside : (p - nearest).norm()).epsilon(1e-9));
  }
}

TEST_CASE("sums, differences and images of boxes are boxes") {
  const convex_polytope<3> a{box{{0, 0, 0}, {4, 3, 2}}}, b{box{{-0.5, -0.5, 0}, {0.5, 0.5, 1}}};
  CHECK(minkowski_sum(a, b).volume() == doctest::Approx(5 * 4 * 3));
  CHECK(minkowski_difference(a, b).volume() == doctest::Approx(3 * 2 * 1));
  CHECK(minkowski_difference(b, a).empty());
  Eigen::Affine3d stretch = Eigen::Affine3d::Identity();
  stretch.linear() = Eigen::Vector3d{2, 3, 0}.asDiagonal();
  stretch.translation() = Eigen::Vector3d{0, 0, 7};
  const auto shadow = transform_polytope(a, stretch);
  CHECK(shadow.affine_dimension() == 2);
  CHECK(shadow.measure() == doctest::Approx(8 * 9));
  CHECK(shadow.contains(Eigen::Vector3d{1, 1, 7}));
  const Eigen::Isometry3d turn{
      make_transform<Eigen::Isometry3d>(rotation(3, 2), Eigen::Vector3d{1e6, 0, 0})};
  CHECK(transform_polytope(a, turn).volume() == doctest::Approx(24).epsilon(1e-8));
  CHECK(transform_polytope(shadow, turn).affine_dimension() == 2);
}

TEST_CASE_TEMPLATE("a tolerance makes hulls flat, and never fail", S, float, double) {
  const point_matrix<S, 3> cube = test::random_points<test::space<S, 3>>(500, 3);
  point_matrix<S, 3> wall = cube;
  wall.row(2) *= S(1e-3);
  for (const double tolerance : {0.0, 1e-6, 1e-4, 1e-3, 5e-3, 0.05, 0.2}) {
    CAPTURE(tolerance);
    const auto solid = convex_hull(cube, {.tolerance = tolerance});
    CHECK(solid.affine_dimension() == 3);
    CHECK(solid.volume() == convex_hull(cube).volume());
    const auto thin = convex_hull(wall, {.tolerance = tolerance});
    CHECK(thin.affine_dimension() == (tolerance < 3e-3 ? 3 : 2));
    const auto in = thin.contains_each(wall);
    CHECK(std::ranges::count(in, 1) == 500);
  }
}

TEST_CASE(
    "hulls in four and five dimensions are as large as closed forms, also where facets merge") {
  for (const index_t d : {4, 5}) {
    const index_t side = d == 4 ? 5 : 3;
    index_t count = 1;
    for (index_t k = 0; k < d; ++k) count *= side;
    Eigen::MatrixXd grid(d, count);
    for (index_t i = 0; i < count; ++i)
      for (index_t k = 0, rest = i; k < d; ++k, rest /= side) grid(k, i) = double(rest % side);
    const Eigen::MatrixXd turned = rotation(d, 3) * grid;
    const double volume = std::pow(double(side - 1), double(d));
    for (const double noise : {0.0, 1e-14, 1e-12, 1e-10, 1e-8})
      for (const bool simplicial : {false, true}) {
        CAPTURE(noise);
        random_stream random{1};
        Eigen::MatrixXd points = turned;
        for (index_t i = 0; i < points.size(); ++i)
          points.data()[i] += noise * random.uniform(-1, 1);
        const auto hull = convex_hull(points, {.simplicial = simplicial});
        CHECK(hull.volume() == doctest::Approx(volume).epsilon(1e-12 + 20 * noise));
        if (!simplicial) continue;
        CHECK(hull.simplices().rows() == d);
        CHECK(hull.simplices().cols() == hull.facets().size());
        for (const auto& facet : hull.facets()) {
          CHECK(std::ssize(facet.vertices) == d);
          CHECK(std::ssize(facet.neighbors) == d);
        }
      }
  }
}

TEST_CASE("parallel facets of sets that contain lines are no neighbours") {
  for (const index_t d : {3, 4, 5}) {
    Eigen::MatrixXd normals = Eigen::MatrixXd::Zero(d, 3);
    normals.row(0) << 1, -1, 0;
    normals(1, 2) = 1;
    const auto half_slab = intersect_half_spaces(normals, std::vector{1.0, 1.0, 1.0});
    REQUIRE(half_slab.facets().size() == 3);
    for (const auto& facet : half_slab.facets())
      CHECK(std::ssize(facet.neighbors) == (std::abs(facet.normal[0]) > 0.5 ? 1 : 2));
  }
}
