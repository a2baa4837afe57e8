// SPDX-License-Identifier: MIT
//
// PCD, text and NumPy files of many exporters, some of them odd on purpose.
#include <cmath>
#include <filesystem>
#include <string>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

/// What a file holds: points, the sum of all their world coordinates (worked out apart from this
/// library), and what else it knows; or, in words, why it is refused.
struct expectation {
  std::string file;
  index_t points = 0;
  double sum = 0;
  bool normals = false, colors = false;
  int attributes = 0;
  int width = 0;
  std::string refusal = {};
};

const expectation expectations[] = {
    {"diamond_pyntcloud/diamond.xyz", 6, 9, true, false, 0, 0},
    {"pcd/pcl/bun0.pcd", 397, 40.04684499, true, false, 1, 0},
    {"pcd/pcl/bun4.pcd", 361, 59.15858386, false, false, 0, 0},
    {"pcd/pcl/bunny.pcd", 397, 40.04684499, false, false, 0, 0},
    {"pcd/pcl/car6.pcd", 10031, -1085870.405, false, false, 0, 0},
    {"pcd/pcl/colored_cloud.pcd", 1000, 477.8130058, true, true, 1, 1},
    {"pcd/pcl/milk_color.pcd", 13704, 7965.647922, false, true, 1, 0},
    {"pcd/pcl/nhood_test.pcd", 36, -9.351439297, false, false, 1, 0},
    {"pcd/pcl/octants.pcd", 8, -97, false, false, 0, 0},
    {"pcd/pcl/pcl_logo.pcd", 12909, 2143.444799, false, true, 0, 0},
    {"pcd/pdal/autzen-utm.pcd", 1065, 5721991325, false, false, 13, 0},
    {.file = "pcd/pdal/missingheader.pcd",
     .refusal = "line 1: \"289814.15\" is no word of a PCD header"},
    {"pcd/pdal/utm17_comma.pcd", 10, 46109666.01, false, false, 0, 0},
    {"pcd/pdal/utm17_space.pcd", 10, 46109666.01, false, false, 0, 0},
    {"pcd/pdal/utm17_tab.pcd", 10, 46109666.01, false, false, 0, 0},
    {"ply/open3d/my_points.txt", 4, 3, false, false, 0, 0},
    {"ply/open3d/simple.xyz", 4, 3, false, false, 0, 0},
    {"pts/pdal/autzen.pts", 10, 14856448.76, false, true, 1, 0},
    {"pts/pdal/bunny_8.pts", 8, 0.936106, false, false, 0, 0},
    {"pts/pdal/site_56_8.pts", 8, 58939.88272, false, false, 1, 0},
    {"pts/pdal/test.pts", 19, -787.807878, false, true, 1, 0},
    {"xyz/trimesh/points_agisoft.xyz", 100, 631377665.4, false, true, 0, 0},
    {"xyz/trimesh/points_cloudcompare.xyz", 101, 637691376.3, false, true, 1, 0},
};

template <class S>
void expect_all() {
  for (const auto& e : expectations) {
    CAPTURE(e.file);
    const auto path = test::data_file("formats/" + e.file);
    REQUIRE(path);
    try {
      const auto cloud = read_cloud<S>(*path);
      CHECK(e.refusal == "");
      CHECK(cloud.size() == e.points);
      double sum = 0;
      for (index_t i = 0; i < cloud.size(); ++i)
        if (cloud.points.col(i).allFinite())
          sum += (cloud.points.col(i).template cast<double>() + cloud.full_origin()).sum();
      CHECK(sum == doctest::Approx(e.sum).epsilon(1e-6));
      CHECK(cloud.has_normals() == e.normals);
      CHECK(cloud.has_colors() == e.colors);
      CHECK(std::ssize(cloud.attributes) == e.attributes);
      CHECK(cloud.width == e.width);
    } catch (const io_error& error) {
      const std::string message = error.what();
      CAPTURE(message);
      CHECK(e.refusal != "");
      CHECK(message.ends_with(e.refusal));
    }
  }
}

}  // namespace

TEST_CASE_TEMPLATE("every PCD and text file of the collection is read as expected, or refused", S,
                   float, double) {
  SKIP_WITHOUT(test::data_file("formats"));
  expect_all<S>();
}

TEST_CASE("the coordinates of maps are read to the millimetre, into float") {
  SKIP_WITHOUT(test::data_file("formats"));
  for (const char* name :
       {"pcd/pdal/autzen-utm.pcd", "pts/pdal/autzen.pts", "xyz/trimesh/points_agisoft.xyz"}) {
    CAPTURE(name);
    const auto path = *test::data_file(std::string{"formats/"} + name);
    const auto narrow = read_cloud<float>(path);
    const auto wide = read_cloud<double>(path);
    CHECK(narrow.has_origin());
    CHECK(((narrow.points.cast<double>().colwise() + narrow.origin) - wide.points)
              .cwiseAbs()
              .maxCoeff() < 1e-3);
    CHECK((read_cloud<float>(path, {.origin = origin_policy::none}).points.cast<double>() -
           wide.points)
              .cwiseAbs()
              .maxCoeff() > 0.01);
  }
}

TEST_CASE("structured and three-dimensional arrays of NumPy are refused") {
  SKIP_WITHOUT(test::data_file("formats"));
  for (const char* name : {"twodim.npy", "threedim.npy", "1.2-with-color.npy"})
    CHECK_THROWS_AS(
        (void)read_matrix<double>(*test::data_file(std::string{"formats/npy/pdal/"} + name)),
        io_error);
}
