// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "spaces.hpp"
import cilantro;
import test_support;

using namespace cilantro;

namespace {

struct reference_set {
  const char* name;
  index_t vertices, facets;
  double area, volume;
};

/// What Qhull's own program says of what its generator makes.
const reference_set references[] = {
    {"cube3", 8, 6, 6, 1},
    {"d2_30", 10, 10, 3.2874534, 0.78179775},
    {"d3_100", 31, 58, 4.4278788, 0.74222363},
    {"d3_1000s", 1000, 1996, 3.1209952, 0.51675716},
    {"d4_50", 27, 116, 3.0734138, 0.32901204},
    {"d5_40", 36, 418, 1.2493892, 0.093816533},
    {"d6_30", 30, 762, 0.46230815, 0.024616215},
    {"cosph", 200, 396, 3.031787, 0.48707706},
    {"lattice", 8, 6, 1350, 3375},
    {"diamond4", 8, 16, 0.66666667, 0.041666667},
    {"spiral", 30, 56, 2.5379735, 0.25975595},
};

Eigen::MatrixXd rbox_points(const std::filesystem::path& file) {
  std::ifstream in{file};
  int dimension = 0, count = 0;
  std::string rest;
  in >> dimension;
  std::getline(in, rest);
  in >> count;
  Eigen::MatrixXd points(dimension, count);
  for (int i = 0; i < count; ++i)
    for (int d = 0; d < dimension; ++d) in >> points(d, i);
  return points;
}

}  // namespace

TEST_CASE(
    "hulls of the reference sets have the vertices, facets, area and volume that Qhull states") {
  const auto folder = test::data_file("reference/qhull/rbox_refs");
  SKIP_WITHOUT(folder);
  for (const auto& expected : references) {
    CAPTURE(expected.name);
    const auto points = rbox_points(*folder / (std::string{expected.name} + ".txt"));
    const auto hull = convex_hull(points);
    CHECK(hull.status() == polytope_status::bounded);
    CHECK(hull.vertices().size() == expected.vertices);
    CHECK(hull.facets().size() == expected.facets);
    CHECK(hull.area() == doctest::Approx(expected.area).epsilon(1e-7));
    CHECK(hull.volume() == doctest::Approx(expected.volume).epsilon(1e-7));
    CHECK(hull.tolerance() < 1e-11);
    // And back: from the half-spaces the same set, and from its vertices the same again.
    const auto again = intersect_half_spaces(hull.normals(), hull.offsets());
    CHECK(again.vertices().size() == expected.vertices);
    CHECK(again.facets().size() == expected.facets);
    CHECK(again.area() == doctest::Approx(expected.area).epsilon(1e-7));
    CHECK(again.volume() == doctest::Approx(expected.volume).epsilon(1e-7));
    const auto facets = hull.facets();
    for (index_t f = 0; f < facets.size(); ++f)
      for (const auto n : facets[f].neighbors) {
        CHECK(n != f);
        CHECK(std::ranges::count(facets[n].neighbors, f) == 1);
      }
  }
}
