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

using d4 = test::space<double, 4>;

template <int D>
convex_polytope<D> random_polytope(std::uint64_t seed, double spread, int corners = 12) {
  random_stream random{seed};
  const auto points = test::random_points<test::space<double, D>>(corners, seed, -0.6, 0.6);
  point_vector<double, D> center;
  for (int d = 0; d < D; ++d) center[d] = random.uniform(-spread, spread);
  return convex_hull(point_matrix<double, D>{points.colwise() + center});
}

/// A matrix of orthonormal columns.
template <int D>
Eigen::Matrix<double, D, D> random_rotation(random_stream& random) {
  Eigen::Matrix<double, D, D> axes;
  for (int j = 0; j < D; ++j) {
    for (int i = 0; i < D; ++i) axes(i, j) = random.uniform(-1, 1);
    for (int twice = 0; twice < 2; ++twice)
      for (int k = 0; k < j; ++k) axes.col(j) -= axes.col(k).dot(axes.col(j)) * axes.col(k);
    axes.col(j).normalize();
  }
  return axes;
}

/// What random sets of half-spaces have in common, with the origin inside.
template <int D>
convex_polytope<D> random_wedge(random_stream& random, int count) {
  point_matrix<double, D> normals(D, count);
  std::vector<double> offsets;
  for (int i = 0; i < count; ++i) {
    normals.col(i) = random_rotation<D>(random).col(0);
    offsets.push_back(random.uniform(0, 0.4));
  }
  return intersect_half_spaces(normals, offsets);
}

/// A box whose corners are on a grid of quarters, so that many share planes and corners.
template <int D>
convex_polytope<D> random_grid_box(random_stream& random) {
  point_vector<double, D> low, high;
  for (int d = 0; d < D; ++d) {
    low[d] = std::floor(random.uniform(-3, 1)) / 4;
    high[d] = low[d] + (1 + std::floor(random.uniform(0, 3))) / 4;
  }
  return convex_polytope<D>{box{low, high}};
}

/// A box in any direction.
template <int D>
convex_polytope<D> random_rotated_box(random_stream& random) {
  const auto axes = random_rotation<D>(random);
  point_matrix<double, D> normals(D, 2 * D);
  normals << axes, -axes;
  std::vector<double> offsets;
  for (int i = 0; i < 2 * D; ++i) offsets.push_back(random.uniform(0.1, 0.6));
  return intersect_half_spaces(normals, offsets);
}

/// Sets of different kinds, bounded and unbounded.
template <int D>
convex_polytope<D> random_set(random_stream& random, int kind) {
  switch (kind % 5) {
    case 0:
      return random_grid_box<D>(random);
    case 1:
      return random_rotated_box<D>(random);
    case 2:
      return random_polytope<D>(std::uint64_t(random.uniform(1, 1e6)), 0.3, D + 3);
    case 3:
      return random_wedge<D>(random, 1);
    default:
      return random_wedge<D>(random, 4);
  }
}

/// The volume of a union of boxes, by the grid of all their planes.
double volume_by_grid(const std::vector<box>& boxes) {
  std::vector<double> cuts[3];
  for (const auto& b : boxes)
    for (int d = 0; d < 3; ++d) cuts[d].insert(cuts[d].end(), {b.lower[d], b.upper[d]});
  for (auto& c : cuts) std::ranges::sort(c);
  double sum = 0;
  for (std::size_t i = 1; i < cuts[0].size(); ++i)
    for (std::size_t j = 1; j < cuts[1].size(); ++j)
      for (std::size_t k = 1; k < cuts[2].size(); ++k) {
        const Eigen::Vector3d middle{cuts[0][i - 1] + cuts[0][i], cuts[1][j - 1] + cuts[1][j],
                                     cuts[2][k - 1] + cuts[2][k]};
        if (std::ranges::any_of(boxes, [&](const box& b) { return b.contains(middle / 2); }))
          sum += (cuts[0][i] - cuts[0][i - 1]) * (cuts[1][j] - cuts[1][j - 1]) *
                 (cuts[2][k] - cuts[2][k - 1]);
      }
  return sum;
}

std::vector<box> random_boxes(int count, std::uint64_t seed, double spread) {
  random_stream random{seed};
  std::vector<box> boxes;
  for (int i = 0; i < count; ++i) {
    Eigen::Vector3d low, high;
    for (int d = 0; d < 3; ++d) {
      low[d] = random.uniform(0, spread);
      high[d] = low[d] + random.uniform(0.4, 1);
    }
    boxes.push_back({low, high});
  }
  return boxes;
}

}  // namespace

TEST_CASE("unions of boxes have the volume of the grid of their planes") {
  for (const double away : {0.0, 1e3}) {
    auto boxes = random_boxes(16, 3, 1);
    space_region<3> all;
    for (auto& b : boxes) {
      Eigen::Vector3d low, high;
      for (int d = 0; d < 3; ++d) {
        low[d] = b.lower[d] + away;
        high[d] = b.upper[d] + away;
      }
      b = {low, high};
      all |= space_region<3>{b};
    }
    CHECK(all.volume() == doctest::Approx(volume_by_grid(boxes)).epsilon(1e-11 + 1e-15 * away));
  }
}

TEST_CASE("regions contain what the sets that they are made of say") {
  const auto a = space_region{random_polytope<3>(1, 0.3)} | random_polytope<3>(2, 0.3);
  const auto b = random_polytope<3>(3, 0.3);
  const auto c = random_polytope<3>(4, 0.3);
  const auto either = a | b;
  const auto both = a & space_region{b};
  const auto first = a - b - c;
  const auto neither = ~(a | b);
  const auto points = test::random_points<test::d3>(10000, 9, -1.2, 1.2);
  index_t wrong = 0;
  for (index_t i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3d p = points.col(i);
    const bool in_a = a.contains(p), in_b = b.contains(p), in_c = c.contains(p);
    wrong += either.contains(p) != (in_a || in_b);
    wrong += both.contains(p) != (in_a && in_b);
    wrong += first.contains(p) != (in_a && !in_b && !in_c);
    wrong += neither.contains(p) != !(in_a || in_b);
  }
  CHECK(wrong == 0);
  CHECK(either.volume() + both.volume() == doctest::Approx(a.volume() + b.volume()).epsilon(1e-12));
  CHECK(first.volume() < a.volume());
  CHECK(std::isinf(neither.volume()));
  const auto in_first = first.contains_each(points);
  for (index_t i = 0; i < points.cols(); ++i)
    wrong += bool(in_first[i]) != first.contains(Eigen::Vector3d{points.col(i)});
  CHECK(wrong == 0);
}

TEST_CASE_TEMPLATE("pieces are as large as the polytopes that they make", T, test::d2, test::d3, d4,
                   test::d5) {
  constexpr int D = T::dimension;
  // In higher dimensions, polytopes of as many corners have hundreds of pieces.
  constexpr int corners = D <= 3 ? 12 : D == 4 ? 9 : 8;
  constexpr std::uint64_t seeds = D <= 3 ? 60 : D == 4 ? 8 : 2;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const auto a = random_polytope<D>(3 * seed, 0.3, corners);
    const auto b = random_polytope<D>(3 * seed + 1, 0.3, corners);
    const auto c = random_polytope<D>(3 * seed + 2, 0.3, corners);
    // Of two polytopes, by the duality of half-spaces; of regions, by cutting.
    const auto both = a & b;
    CHECK((space_region{a} & space_region{b}).volume() ==
          doctest::Approx(both.volume()).epsilon(1e-11));
    const double all = a.volume() + b.volume() + c.volume() - both.volume() - (b & c).volume() -
                       (a & c).volume() + (both & c).volume();
    CHECK((a | b | c).volume() == doctest::Approx(all).epsilon(1e-11));
    CHECK(((a | b) - c).volume() == doctest::Approx(all - c.volume()).epsilon(1e-11));
    CHECK((~~(a | b) - c).volume() == doctest::Approx(all - c.volume()).epsilon(1e-9));
  }
}

TEST_CASE_TEMPLATE("regions of sets of all kinds are what logic says", T, test::d2, test::d3, d4) {
  constexpr int D = T::dimension;
  using vector = point_vector<double, D>;
  const space_region<D> window{
      convex_polytope<D>{box{vector::Constant(-1.5), vector::Constant(1.5)}}};
  const auto volume = [&](const space_region<D>& region) { return (region & window).volume(); };
#if __has_feature(address_sanitizer)
  constexpr int stride = 4;
#else
  constexpr int stride = 1;
#endif
  for (int kinds = 0; kinds < 75; kinds += stride) {
    CAPTURE(kinds);
    random_stream random{std::uint64_t(kinds + 1)};
    const auto a = random_set<D>(random, kinds), b = random_set<D>(random, kinds / 5);
    const auto c = random_set<D>(random, kinds / 25);
    const auto either = space_region<D>{a} | b, both = space_region<D>{a} & space_region<D>{b};
    const auto first = a - b;
    const auto neither = ~either, again = ~neither, less = again - c, none = neither - c;
    auto turn = Eigen::Transform<double, D, Eigen::Affine>::Identity();
    turn.linear() = random_rotation<D>(random);
    turn.translation() = vector::Constant(0.1);
    const auto turned = transform_region(first, turn);
    index_t wrong = 0;
    for (int i = 0; i < 200; ++i) {
      // Some are far away, where only sets without an end are.
      vector p;
      for (int d = 0; d < D; ++d) p[d] = random.uniform(-1.2, 1.2) * (i % 10 == 0 ? 100 : 1);
      const bool in_a = a.contains(p), in_b = b.contains(p), in_c = c.contains(p);
      wrong += either.contains(p) != (in_a || in_b);
      wrong += less.contains(p) != ((in_a || in_b) && !in_c);
      wrong += none.contains(p) != !(in_a || in_b || in_c);
      wrong += again.contains(p) != (in_a || in_b);
      wrong += both.contains(p) != (in_a && in_b);
      wrong += first.contains(p) != (in_a && !in_b);
      wrong += neither.contains(p) != !(in_a || in_b);
      wrong += turned.contains(vector{turn * p}) != (in_a && !in_b);
    }
    CHECK(wrong == 0);
    const double all = std::pow(3, D),
                 sum = volume(space_region<D>{a}) + volume(space_region<D>{b});
    CHECK(volume(either) + volume(both) == doctest::Approx(sum).epsilon(1e-11));
    CHECK(volume(space_region<D>{a & b}) + 1 == doctest::Approx(volume(both) + 1).epsilon(1e-11));
    CHECK(volume(either) + volume(neither) == doctest::Approx(all).epsilon(1e-11));
    CHECK(volume(again) == doctest::Approx(volume(either)).epsilon(1e-11));
    CHECK(volume(none) + volume(less) + volume(space_region<D>{c}) ==
          doctest::Approx(all).epsilon(1e-11));
    if (first.is_bounded())
      CHECK(turned.volume() + 1 == doctest::Approx(first.volume() + 1).epsilon(1e-11));
  }
}

TEST_CASE("unions of boxes in four dimensions have the volume of their grid, turned and away") {
  constexpr int D = 4, cells = 7;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    CAPTURE(seed);
    const double away = seed % 4 == 0 ? 1e3 : 0;
    random_stream random{seed};
    const auto axes = random_rotation<D>(random);
    point_matrix<double, D> normals(D, 2 * D);
    normals << axes, -axes;
    std::vector<box> boxes;
    space_region<D> all;
    for (int i = 0; i < 10; ++i) {
      Eigen::Vector4d low, high;
      for (int d = 0; d < D; ++d) {
        low[d] = std::floor(random.uniform(0, 4));
        high[d] = low[d] + 1 + std::floor(random.uniform(0, 2.5));
      }
      boxes.push_back({low, high});
      const Eigen::Vector4d shift = axes.transpose() * Eigen::Vector4d::Constant(away);
      std::vector<double> offsets;
      for (int d = 0; d < D; ++d) offsets.push_back(high[d] + shift[d]);
      for (int d = 0; d < D; ++d) offsets.push_back(-low[d] - shift[d]);
      all |= intersect_half_spaces(normals, offsets);
    }
    double by_grid = 0;
    for (int cell = 0; cell < cells * cells * cells * cells; ++cell) {
      Eigen::Vector4d middle;
      for (int d = 0, rest = cell; d < D; ++d, rest /= cells) middle[d] = rest % cells + 0.5;
      by_grid += std::ranges::any_of(boxes, [&](const box& b) { return b.contains(middle); });
    }
    const auto expected = doctest::Approx(by_grid).epsilon(1e-12 + 1e-14 * away);
    CHECK(all.volume() == expected);
    CHECK((~~all).volume() == expected);
    CHECK(all.simplified().volume() == expected);
  }
}

TEST_CASE("10000 points are where the parts of regions in four dimensions say, bounded or not") {
  const Eigen::Matrix4Xf in_float = test::random_points<d4>(9, 2, -0.6, 0.6).cast<float>();
  const auto a = space_region{random_polytope<4>(1, 0.3, 9)} | convex_hull(in_float);
  random_stream random{5};
  const auto b = random_rotated_box<4>(random), c = random_wedge<4>(random, 5);
  const auto either = a | b | c, first = a - b - c, neither = ~either;
  const auto points = test::random_points<d4>(10000, 9, -1.2, 1.2);
  const auto in_a = a.contains_each(points), in_b = b.contains_each(points);
  const auto in_c = c.contains_each(points), in_either = either.contains_each(points);
  const auto in_first = first.contains_each(points), in_neither = neither.contains_each(points);
  index_t wrong = 0;
  for (index_t i = 0; i < points.cols(); ++i) {
    const bool any = in_a[i] || in_b[i] || in_c[i];
    wrong += bool(in_either[i]) != any;
    wrong += bool(in_first[i]) != (in_a[i] && !in_b[i] && !in_c[i]);
    wrong += bool(in_neither[i]) == any;
  }
  CHECK(wrong == 0);
}

TEST_CASE("complements of nothing and of everything are each other") {
  const space_region<3> nothing;
  const auto everything = ~nothing;
  CHECK(everything.contains(Eigen::Vector3d{1e6, 0, -5}));
  CHECK((~everything).empty());
  CHECK((everything & nothing).empty());
  CHECK((everything | nothing).piece_count() == 1);
  const space_region<3> cube{box{{0, 0, 0}, {1, 1, 1}}};
  CHECK((cube | nothing).volume() == doctest::Approx(1));
  CHECK((~~cube).volume() == doctest::Approx(1));
  CHECK((cube - everything).empty());
  CHECK((cube - cube).empty());
  CHECK((cube | cube).volume() == doctest::Approx(1));
}

TEST_CASE("a box without a smaller one is a shell, and simplifies to few pieces") {
  const convex_polytope<3> inner{box{{1, 1, 1}, {2, 2, 2}}};
  const space_region shell = box{{0, 0, 0}, {3, 3, 3}} - inner;
  CHECK(shell.volume() == doctest::Approx(26));
  CHECK_FALSE(shell.contains(Eigen::Vector3d{1.5, 1.5, 1.5}));
  CHECK(shell.contains(Eigen::Vector3d{1, 1.5, 1.5}));
  CHECK(shell.distance(Eigen::Vector3d{1.5, 1.5, 1.4}) == doctest::Approx(0.4));
  CHECK(shell.piece_count() <= 6);
  const auto whole = (shell | inner).simplified();
  CHECK(whole.piece_count() == 1);
  CHECK(whole.volume() == doctest::Approx(27));
}

TEST_CASE("a region without a dimension has no complement") {
  const space_region<dynamic> nowhere;
  CHECK_THROWS_AS((void)~nowhere, invalid_input);
  CHECK_THROWS_AS((void)~space_region<dynamic>{convex_hull(Eigen::MatrixXd{})}, invalid_input);
}
