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
  CHECK(half.interior_ball());

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
        const auto found = intersect_half_spaces(from.normals, from.offsets, away * 1e-14);
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
