// SPDX-License-Identifier: MIT
//
// Road distances between 21 cities, the textbook example of classical scaling.
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

TEST_CASE("the map of the cities is the published one, up to rotation and reflection") {
  const auto file = test::data_file("reference/mds/eurodist.csv");
  SKIP_WITHOUT(file);
  std::ifstream in{*file};
  std::string line;
  std::getline(in, line);
  std::vector<std::string> names;
  Eigen::MatrixXd distances(21, 21);
  for (index_t i = 0; i < 21; ++i) {
    REQUIRE(std::getline(in, line));
    std::istringstream cells{line};
    std::string cell;
    std::getline(cells, cell, ',');
    names.push_back(cell);
    for (index_t k = 0; k < 21; ++k) {
      std::getline(cells, cell, ',');
      distances(i, k) = std::stod(cell);
    }
  }
  const auto found = multidimensional_scaling(distances, {.dimension = 2});
  // R's cmdscale(eurodist): the first cities, eigenvalues and goodness of fit as its manual prints.
  Eigen::Matrix2Xd published(2, 4);
  published << 2290.274680, -825.382790, 59.183341, -82.845973,  //
      1798.8029, 546.8115, -367.0814, -429.9147;
  CHECK(names[0] == "Athens");
  CHECK(names[3] == "Calais");
  for (index_t k = 0; k < 2; ++k) {
    const double sign = found.points(k, 0) * published(k, 0) > 0 ? 1 : -1;
    for (index_t i = 0; i < 4; ++i)
      CHECK(sign * found.points(k, i) == doctest::Approx(published(k, i)).epsilon(1e-6));
  }
  CHECK(found.eigenvalues[0] == doctest::Approx(19538377.0895));
  CHECK(found.eigenvalues[1] == doctest::Approx(11856555.3340));
  CHECK(found.eigenvalues.head(2).sum() / found.eigenvalues.cwiseAbs().sum() ==
        doctest::Approx(0.7537543));
  CHECK(*found.smallest_eigenvalue < -2e6);
  CHECK(multidimensional_scaling(distances).points.rows() == 2);
}
