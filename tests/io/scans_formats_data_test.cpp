// SPDX-License-Identifier: MIT
//
// PTX and E57 files of other programs.
#include <cmath>
#include <numeric>
#include <string>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

/// What a file holds, worked out apart from this library: points, the sum of their world
/// coordinates, that of the intensities, and that of the colours from 0 to 255.
struct expectation {
  std::string file;
  index_t points = 0;
  double sum = 0, intensities = 0, colors = 0;
};

const expectation expectations[] = {
    {"ptx/pdal/1.2-with-color.ptx", 1065, 1585764095.66, 19.863535, 382913},
    {"ptx/pdal/complex-transform.ptx", 4, -32.118062730654, 1.973113, 368},
    {"ptx/pdal/multiple-and-transform.ptx", 8, 11890673.04, 0.18506, 0},
    {"ptx/pdal/no-color.ptx", 15, 22289220.45, 0.356202, 0},
    {"e57/libe57format/ColouredCubeFloat.e57", 7680, -62.450788110494614, 0, 1958400},
    {"e57/libe57format/ColouredCubeDouble.e57", 7680, -62.450788110494614, 0, 1958400},
};

}  // namespace

TEST_CASE_TEMPLATE("every PTX and E57 file of the collection is read as expected", S, float,
                   double) {
  SKIP_WITHOUT(test::data_file("formats"));
  for (const auto& e : expectations) {
    CAPTURE(e.file);
    const auto path = test::data_file("formats/" + e.file);
    REQUIRE(path);
    const auto cloud = read_cloud<S>(*path);
    CHECK(cloud.size() == e.points);
    double sum = 0;
    for (index_t i = 0; i < cloud.size(); ++i)
      sum += (cloud.points.col(i).template cast<double>() + cloud.full_origin()).sum();
    CHECK(sum == doctest::Approx(e.sum).epsilon(1e-6));
    if (cloud.find_attribute("intensity") != nullptr) {
      const auto values = cloud.template attribute_to<double>("intensity");
      CHECK(std::accumulate(values.begin(), values.end(), 0.0) ==
            doctest::Approx(e.intensities).epsilon(1e-9));
    } else {
      CHECK(e.intensities == 0);
    }
    CHECK(cloud.colors.template cast<double>().sum() * 255 ==
          doctest::Approx(e.colors).epsilon(1e-6));
  }
}
