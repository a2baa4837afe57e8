// SPDX-License-Identifier: MIT
//
// Against exact rational arithmetic: half_space_oracle.py has made the file of sets and answers.
#include <cstdint>
#include <fstream>
#include <limits>
#include <string>

#include <doctest/doctest.h>

import cilantro;
import test_support;

using namespace cilantro;

TEST_CASE("intersections of half-spaces are what exact arithmetic says") {
  std::ifstream in{CILANTRO_HALF_SPACE_SETS};
  REQUIRE(in);
  std::string word;
  std::getline(in, word);
  int count = 0;
  std::string name;
  index_t d = 0, rows = 0, affine = 0, bounded = 0, vertices = 0, facets = 0;
  double volume = 0;
  while (in >> word >> name >> d >> rows >> affine >> bounded >> vertices >> facets >> volume) {
    CAPTURE(count);
    CAPTURE(name);
    CAPTURE(d);
    Eigen::MatrixXd normals(d, rows);
    Eigen::VectorXd offsets(rows);
    for (index_t i = 0; i < rows; ++i) {
      for (index_t k = 0; k < d; ++k) in >> normals(k, i);
      in >> offsets[i];
    }
    ++count;
    const auto found = intersect_half_spaces(normals, offsets);
    CHECK(found.affine_dimension() == affine);
    if (affine < 0) continue;
    CHECK(found.is_bounded() == (bounded == 1));
    if (vertices > 0) CHECK(found.vertices().size() == vertices);
    if (volume > 0) {
      CHECK(found.facets().size() == facets);
      CHECK(found.volume() == doctest::Approx(volume).epsilon(1e-9));
      // The other way round, from the corners.
      const auto hull = convex_hull(found.vertices());
      CHECK(hull.affine_dimension() == affine);
      CHECK(hull.vertices().size() == vertices);
      CHECK(hull.facets().size() == facets);
      CHECK(hull.volume() == doctest::Approx(volume).epsilon(1e-9));
    }
  }
  CHECK(count == 300);
}
