// SPDX-License-Identifier: MIT
//
// Points and half-spaces of numbers that are hard on geometry: many equal, huge, tiny, not finite.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <stdexcept>
#include <vector>

#include <doctest/doctest.h>

import cilantro;
import test_support;

using namespace cilantro;

namespace {

double hostile_number(random_stream& random) {
  static const double numbers[] = {0,
                                   1,
                                   -1,
                                   2,
                                   -2,
                                   0.5,
                                   3,
                                   1 + 0x1p-52,
                                   1e-9,
                                   -1e-9,
                                   1e9,
                                   -1e9,
                                   1e-300,
                                   1e300,
                                   1e-17,
                                   -1e-17,
                                   1e5,
                                   5e-324,
                                   1e-160,
                                   1e160,
                                   test::nan<double>,
                                   test::infinity<double>,
                                   -test::infinity<double>};
  // Small numbers most of the time, so that many coincide.
  const auto pick = random.uniform(0, 1);
  if (pick < 0.7) return std::floor(random.uniform(-3, 4));
  if (pick < 0.8) return random.uniform(-1, 1);
  return numbers[static_cast<std::size_t>(random.uniform(0, std::size(numbers)))];
}

index_t whole(random_stream& random, double from, double to) {
  return static_cast<index_t>(random.uniform(from, to));
}

/// More rounds, to be run by hand: 10⁶ take some minutes.
int rounds() {
  const char* wanted = std::getenv("CILANTRO_HOSTILE_ROUNDS");
  return wanted ? std::atoi(wanted) : 1500;
}

}  // namespace

TEST_CASE("hulls of hostile numbers contain their points, or the call throws") {
  int made = 0;
  for (int round = 0; round < rounds(); ++round) {
    CAPTURE(round);
    random_stream random{static_cast<std::uint64_t>(round)};
    Eigen::MatrixXd points(whole(random, 1, 6), whole(random, 0, 25));
    for (index_t i = 0; i < points.cols(); ++i)
      for (index_t d = 0; d < points.rows(); ++d) points(d, i) = hostile_number(random);
    try {
      const auto hull = convex_hull(points);
      ++made;
      index_t finite = 0, outside = 0;
      for (index_t i = 0; i < points.cols(); ++i)
        if (points.col(i).allFinite()) {
          ++finite;
          outside += !hull.contains(points.col(i), hull.tolerance());
        }
      CHECK(outside == 0);
      CHECK(finite + hull.non_finite() == points.cols());
      CHECK(hull.empty() == (finite == 0));
      CHECK(hull.is_bounded());
      CHECK(hull.measure() >= 0);
    } catch (const invalid_input&) {
    } catch (const std::runtime_error&) {
    }
  }
  CHECK(made > rounds() / 2);
}

TEST_CASE("half-spaces of hostile numbers have an intersection, or the call throws") {
  int made = 0;
  for (int round = 0; round < rounds(); ++round) {
    CAPTURE(round);
    random_stream random{static_cast<std::uint64_t>(round) + 1000000};
    Eigen::MatrixXd normals(whole(random, 1, 5), whole(random, 0, 12));
    std::vector<double> offsets;
    for (index_t i = 0; i < normals.cols(); ++i) {
      for (index_t d = 0; d < normals.rows(); ++d) normals(d, i) = hostile_number(random);
      offsets.push_back(hostile_number(random));
    }
    try {
      const auto found = intersect_half_spaces(normals, offsets);
      ++made;
      CHECK(found.empty() == found.vertices().empty());
      for (const auto& vertex : found.vertices()) CHECK(found.contains(vertex, found.tolerance()));
      if (!found.empty()) CHECK(found.measure() >= 0);
      if (const auto ball = found.interior_ball()) CHECK(found.contains(ball->center));
      (void)(found &
             convex_polytope<>{box{Eigen::VectorXd{Eigen::VectorXd::Constant(normals.rows(), -1)},
                                   Eigen::VectorXd{Eigen::VectorXd::Constant(normals.rows(), 1)}}});
      (void)~found;
    } catch (const invalid_input&) {
    } catch (const std::runtime_error&) {
    }
  }
  CHECK(made > rounds() / 4);
}
