// SPDX-License-Identifier: MIT
//
// Points and half-spaces of numbers that are hard on geometry: many equal, huge, tiny, not finite.
#include <malloc.h>
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

TEST_CASE("hulls of coordinates of which sums are no numbers are refused") {
  for (const index_t count : {5, 5000}) {
    Eigen::MatrixXd points = test::random_points<test::d2>(count);
    CHECK(convex_hull(Eigen::MatrixXd{1e307 * points}).status() == polytope_status::bounded);
    for (const double huge : {1.1e307, 1.2e308, -1.7e308}) {
      points(0, 3) = huge;
      CHECK_THROWS_WITH_AS((void)convex_hull(points),
                           "convex_hull: coordinates must be at most 10^307", invalid_input);
    }
  }
}

TEST_CASE("half-spaces so far away that their corners are no numbers are refused") {
  Eigen::Matrix2Xd normals(2, 2);
  normals << 1, 0, 0, 1;
  const std::vector<double> offsets{-15.0, 0.0};
  CHECK_FALSE(intersect_half_spaces(normals, offsets).empty());
  for (const double tiny : {1e-300, -2.5e-306, 5e-324}) {
    normals(0, 0) = tiny;
    CHECK_THROWS_WITH_AS((void)intersect_half_spaces(normals, offsets),
                         "intersect_half_spaces: an offset is out of range for its normal",
                         invalid_input);
  }
}

TEST_CASE("thousands of hulls leave no memory behind, made or not") {
  const auto make_hulls = [] {
    for (std::uint64_t round = 0; round < 1000; ++round) {
      random_stream random{round};
      Eigen::MatrixXd points(whole(random, 2, 5), whole(random, 0, 20));
      for (index_t i = 0; i < points.size(); ++i)
        points.data()[i] =
            round % 4 == 0 ? hostile_number(random) : std::floor(random.uniform(-3, 4));
      try {
        const auto hull = convex_hull(points);
        (void)hull.interior_ball();
      } catch (const std::exception&) {
      }
    }
  };
  // What is set up once, and what the allocator keeps at hand, counts as used and comes before.
  make_hulls();
  const auto before = mallinfo2().uordblks;
  for (int again = 0; again < 10; ++again) make_hulls();
  const auto after = mallinfo2().uordblks;
  CHECK(after <= before + 4096);
}
