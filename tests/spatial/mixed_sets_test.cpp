// SPDX-License-Identifier: MIT
//
// Boxes, polytopes and regions in any mixture, of dimensions that are known when compiling or not.
#include <algorithm>
#include <concepts>
#include <cstdint>
#include <filesystem>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

import cilantro;
import test_support;

using namespace cilantro;

namespace {

/// Whether a file of triangles says that it has as many faces as the table has columns.
bool has_faces(const std::filesystem::path& path, const auto& triangles) {
  return test::read_file(path).find("element face " + std::to_string(triangles.cols()) + '\n') !=
         std::string::npos;
}

/// One set as each of the types that the operators take.
template <int D>
auto as_each_type(const box& set) {
  return std::tuple{set, convex_polytope<D>{set}, convex_polytope<dynamic>{set},
                    space_region<D>{set}, space_region<dynamic>{set}};
}

template <class T>
constexpr bool is_region = false;
template <int D>
constexpr bool is_region<space_region<D>> = true;
template <class T>
constexpr int dimension_in_type = T::static_dimension;
template <>
constexpr int dimension_in_type<box> = dynamic;

/// In the volume itself, of a box too.
template <class Set>
double volume_of(const Set& set) {
  if constexpr (std::same_as<Set, box>)
    return convex_polytope<dynamic>{set}.volume();
  else
    return set.volume();
}

/// Checks all operators on `a` and `b`, sets whose common part has the volume `common`.
template <int D, class A, class B>
void check_operators(const A& a, const B& b, double common, const Eigen::MatrixXd& points) {
  const auto either = a | b;
  const auto first = a - b;
  const auto both = a & b;
  const auto others = ~a;
  constexpr int dimension =
      dimension_in_type<A> == dynamic ? dimension_in_type<B> : dimension_in_type<A>;
  static_assert(std::same_as<decltype(a | b), space_region<dimension>>);
  static_assert(std::same_as<decltype(a - b), space_region<dimension>>);
  static_assert(std::same_as<decltype(~a), space_region<dimension_in_type<A>>>);
  if constexpr (is_region<A> || is_region<B>)
    static_assert(std::same_as<decltype(a & b), space_region<dimension>>);
  else
    static_assert(std::same_as<decltype(a & b), convex_polytope<dimension>>);
  const double in_a = volume_of(a), in_b = volume_of(b);
  CHECK(either.volume() == doctest::Approx(in_a + in_b - common).epsilon(1e-12));
  CHECK(first.volume() == doctest::Approx(in_a - common).epsilon(1e-12));
  CHECK(both.volume() == doctest::Approx(common).epsilon(1e-12));
  CHECK((others & a).volume() == 0);
  index_t wrong = 0;
  for (index_t i = 0; i < points.cols(); ++i) {
    const auto p = points.col(i);
    const bool is_in_a = a.contains(p), is_in_b = b.contains(p);
    wrong += either.contains(p) != (is_in_a || is_in_b);
    wrong += both.contains(p) != (is_in_a && is_in_b);
    wrong += first.contains(p) != (is_in_a && !is_in_b);
    wrong += others.contains(p) != !is_in_a;
  }
  CHECK(wrong == 0);
  // What is assigned to keeps its type.
  space_region<D> region;
  region |= a;
  region |= b;
  CHECK(region.volume() == doctest::Approx(either.volume()).epsilon(1e-12));
  region -= b;
  CHECK(region.volume() == doctest::Approx(first.volume()).epsilon(1e-12));
  region &= a;
  CHECK(region.volume() == doctest::Approx(first.volume()).epsilon(1e-12));
}

template <int D>
void check_all_mixtures(const box& a, const box& b, double common) {
  const auto points = test::random_points<test::space<double, D>>(200, 5, -1, 4);
  std::apply(
      [&](const auto&... as) {
        const auto with_each = [&](const auto& one) {
          std::apply([&](const auto&... bs) { (check_operators<D>(one, bs, common, points), ...); },
                     as_each_type<D>(b));
        };
        (with_each(as), ...);
      },
      as_each_type<D>(a));
}

}  // namespace

TEST_CASE("boxes, polytopes and regions unite, meet and subtract in every mixture") {
  check_all_mixtures<2>(box{{0, 0}, {2, 2}}, box{{1, 1}, {3, 3}}, 1);
  check_all_mixtures<3>(box{{0, 0, 0}, {2, 2, 2}}, box{{1, 1, 1}, {3, 3, 3}}, 1);
  check_all_mixtures<3>(box{{0, 0, 0}, {1, 1, 1}}, box{{2, 0, 0}, {3, 3, 3}}, 0);
  check_all_mixtures<4>(box{{0, 0, 0, 0}, {3, 3, 3, 3}}, box{{1, 1, 1, 1}, {2, 2, 2, 2}}, 1);
}

TEST_CASE("what is cut out of a box is combined with sets whose type has the dimension") {
  const space_region<3> free = box{{0, 0, 0}, {4, 4, 4}} - box{{1, 1, 1}, {2, 2, 2}} -
                               convex_polytope<3>{box{{3, 3, 3}, {4, 4, 4}}};
  CHECK(free.volume() == doctest::Approx(62));
  const auto frame = (box{{0, 0}, {3, 3}} - box{{1, 1}, {2, 2}}) | box{{5, 5}, {6, 6}};
  CHECK(frame.dimension() == 2);
  CHECK(frame.volume() == doctest::Approx(9));
  const auto wall = box{{0, 0, 0}, {1, 1, 1}} & box{{1, 0, 0}, {2, 1, 1}};
  CHECK(wall.status() == polytope_status::flat);
  CHECK(wall.measure() == doctest::Approx(1));
  CHECK((box{{0, 0}, {1, 1}} & box{{2, 2}, {3, 3}}).empty());
}

TEST_CASE("mixtures of sets whose dimensions turn out to differ are refused") {
  const box square{{0, 0}, {1, 1}}, cube{{0, 0, 0}, {1, 1, 1}};
  const convex_polytope<3> solid{cube};
  const space_region<3> region{cube};
  CHECK_THROWS_AS((void)(square | cube), invalid_input);
  CHECK_THROWS_AS((void)(square - cube), invalid_input);
  CHECK_THROWS_AS((void)(square & cube), invalid_input);
  CHECK_THROWS_AS((void)(square | solid), invalid_input);
  CHECK_THROWS_AS((void)(solid & convex_polytope<dynamic>{square}), invalid_input);
  CHECK_THROWS_AS((void)(region - space_region<dynamic>{square}), invalid_input);
  CHECK_THROWS_AS((void)(~square & solid), invalid_input);
  CHECK_THROWS_AS((void)(~box{{0, 1}, {1, 0}}), invalid_input);
  CHECK_THROWS_AS((void)(cube - box{{0, 0, test::nan<double>}, {1, 1, 1}}), invalid_input);
}

TEST_CASE("dimensions of polytopes and regions become known and unknown, and nothing else does") {
  const convex_polytope<3> cube{box{{0, 0, 0}, {1, 1, 1}}};
  const convex_polytope<dynamic> loose = cube;
  const convex_polytope<3> back = loose;
  CHECK(back.shared() == cube.shared());
  CHECK_THROWS_WITH_AS((void)convex_polytope<2>{loose}, doctest::Contains("another dimension"),
                       invalid_input);
  const space_region<dynamic> region = space_region<3>{cube};
  CHECK(space_region<3>{region}.volume() == doctest::Approx(1));
  CHECK_THROWS_WITH_AS((void)space_region<2>{region}, doctest::Contains("another dimension"),
                       invalid_input);
  // Nothing is nothing in any dimension.
  CHECK(convex_polytope<3>{convex_polytope<dynamic>{}}.dimension() == 3);
  CHECK(space_region<3>{space_region<dynamic>{}}.dimension() == 3);
  CHECK((cube | convex_polytope<dynamic>{}).volume() == doctest::Approx(1));
}

TEST_CASE("pieces and facets that are not there are refused with a sentence") {
  const auto shell = box{{0, 0, 0}, {3, 3, 3}} - box{{1, 1, 1}, {2, 2, 2}};
  for (const index_t i : {index_t{-1}, shell.piece_count(), index_t{1} << 40})
    CHECK_THROWS_WITH_AS((void)shell.piece(i), "piece: there is no piece with this index",
                         invalid_input);
  CHECK_THROWS_AS((void)space_region<3>{}.piece(0), invalid_input);
  const convex_polytope<3> cube{box{{0, 0, 0}, {1, 1, 1}}};
  for (const index_t i : {-1, 6})
    CHECK_THROWS_WITH_AS((void)cube.facets()[i], "facets: there is no facet with this index",
                         invalid_input);
  CHECK_THROWS_AS((void)convex_polytope<2>{}.facets()[0], invalid_input);
}

TEST_CASE("triangles of hulls, triangulations and outlines are written as they are") {
  const test::temporary_folder folder;
  const auto path = folder / "mesh.ply";
  const point_cloud<float, 3> cloud{.points = test::random_points<test::f3>(50)};
  const auto hull = convex_hull(cloud);
  const auto triangles = hull.simplices();
  CHECK(triangles.rows() == 3);
  CHECK(triangles.cols() == 2 * hull.vertices().size() - 4);
  write_ply(select(cloud, hull.indices()), path, {.triangles = triangles});
  CHECK(has_faces(path, triangles));

  const point_cloud<double, 2> flat{.points = test::random_points<test::d2>(50)};
  const auto mesh = delaunay_triangulation(flat);
  write_ply(flat, path, {.triangles = mesh.simplices});
  CHECK(has_faces(path, mesh.simplices));
  const auto covered = concave_hull(flat, {.alpha = 0.5});
  write_ply(flat, path, {.triangles = covered.triangles});
  CHECK(has_faces(path, covered.triangles));

  // What has another number of corners is no triangle.
  CHECK_THROWS_AS(write_ply(flat, path, {.triangles = convex_hull(flat).simplices()}),
                  invalid_input);
  CHECK_THROWS_AS(write_ply(cloud, path, {.triangles = delaunay_triangulation(cloud).simplices}),
                  invalid_input);
  CHECK_THROWS_AS(write_ply(cloud, path, {.triangles = Eigen::MatrixXi(0, 5)}), invalid_input);
  CHECK(convex_polytope<3>{}.simplices().size() == 0);
}
