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

template <int D>
convex_polytope<D> random_polytope(std::uint64_t seed, double spread) {
  random_stream random{seed};
  const auto points = test::random_points<test::space<double, D>>(12, seed, -0.6, 0.6);
  point_vector<double, D> center;
  for (int d = 0; d < D; ++d) center[d] = random.uniform(-spread, spread);
  return convex_hull(point_matrix<double, D>{points.colwise() + center});
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

TEST_CASE_TEMPLATE("pieces are as large as the polytopes that they make", T, test::d2, test::d3) {
  constexpr int D = T::dimension;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const auto a = random_polytope<D>(3 * seed, 0.3), b = random_polytope<D>(3 * seed + 1, 0.3);
    const auto c = random_polytope<D>(3 * seed + 2, 0.3);
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
