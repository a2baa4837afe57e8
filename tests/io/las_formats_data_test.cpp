// SPDX-License-Identifier: MIT
//
// LAS files of other programs, some of them odd on purpose.
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <numeric>
#include <string>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

/// What a file holds, worked out apart from this library: points, the sum of all coordinates, of
/// the intensities, of the numbers of returns and of the times, and the brightest colour as it is
/// in the file; or, in words, why it is refused.
struct expectation {
  std::string file;
  index_t points = 0;
  double sum = 0, intensities = 0, returns = 0, times = 0;
  double brightest = 0;
  std::string refusal = {};
};

const expectation expectations[] = {
    {"las/pdal/1.2-with-color.las", 1065, 1585764095.66, 81361, 1236, 263704809.39078513, 249},
    {"las/pdal/100-points.las", 100, 148914997.74, 7322, 112, 24773426.150946688, 229},
    {"las/pdal/extrabytes.las", 1065, 1585764095.66, 81361, 1236, 263704809.39078513, 249},
    {"las/pdal/no-points.las", 0, 0, 0, 0, 0, 0},
    {"las/pdal/simple.las", 1065, 1585764095.66, 81361, 1236, 263704809.39078513, 249},
    {"las/pdal_permutations/1.0_0.las", 1, 5073597.34, 0, 2, 0, 0},
    {"las/pdal_permutations/1.0_1.las", 1, 5073597.34, 0, 2, 1205902800.0, 0},
    {"las/pdal_permutations/1.1_0.las", 1, 5073597.34, 0, 2, 0, 0},
    {"las/pdal_permutations/1.1_1.las", 1, 5073597.34, 0, 2, 1205902800.0, 0},
    {.file = "las/pdal_permutations/1.2-no-points.las",
     .refusal = "byte 229: the header promises 1065 points of 34 bytes, and only 0 bytes are left"},
    {"las/pdal_permutations/1.2_0.las", 1, 5073597.34, 0, 2, 0, 0},
    {"las/pdal_permutations/1.2_1.las", 1, 5073597.34, 0, 2, 1205902800.0, 0},
    {"las/pdal_permutations/1.2_2.las", 1, 5073597.34, 0, 2, 0, 255},
    {"las/pdal_permutations/1.2_3.las", 1, 5073597.34, 0, 2, 1205902800.0, 255},
    {"diamond_pyntcloud/diamond.las", 6, 9, 0, 0, 0, 65280},
    {"diamond_pyntcloud/diamond.laz", 6, 9, 0, 6, 0, 65280},
};

double sum_of(const auto& cloud, const char* name) {
  if (cloud.find_attribute(name) == nullptr) return 0;
  const auto values = cloud.template attribute_to<double>(name);
  return std::accumulate(values.begin(), values.end(), 0.0);
}

}  // namespace

TEST_CASE_TEMPLATE("every LAS file of the collection is read as expected, or refused", S, float,
                   double) {
  SKIP_WITHOUT(test::data_file("formats"));
  const test::temporary_folder folder;
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
        sum += (cloud.points.col(i).template cast<double>() + cloud.full_origin()).sum();
      CHECK(sum == doctest::Approx(e.sum).epsilon(1e-9));
      CHECK(sum_of(cloud, "intensity") == e.intensities);
      CHECK(sum_of(cloud, "return_number") == e.returns);
      CHECK(sum_of(cloud, "gps_time") == doctest::Approx(e.times).epsilon(1e-12));
      const double unit = e.brightest > 255 ? 65535 : 255;
      if (cloud.has_colors())
        CHECK(cloud.colors.maxCoeff() == static_cast<float>(e.brightest / unit));
      else
        CHECK(e.brightest == 0);

      // Written again with everything, its points are what they were, byte by byte.
      const auto info = las_header(*path);
      if (info.is_compressed || e.file.ends_with("extrabytes.las")) continue;
      write_las(cloud, folder / "a.las", {.like = info});
      const auto before = test::read_file(*path), after = test::read_file(folder / "a.las");
      const auto n = static_cast<std::size_t>(info.points) * info.record_length;
      if (e.brightest == 0 || unit == 65535)
        CHECK(before.substr(before.size() - n) == after.substr(after.size() - n));
      for (const auto& r : info.records)
        CHECK(*las_header(folder / "a.las").find_record(r.user_id, r.id) == r);
    } catch (const io_error& error) {
      const std::string message = error.what();
      CAPTURE(message);
      CHECK(e.refusal != "");
      CHECK(message.ends_with(e.refusal));
    }
  }
}

TEST_CASE("the extra bytes that a file describes are attributes") {
  SKIP_WITHOUT(test::data_file("formats"));
  const auto cloud = read_las<double>(*test::data_file("formats/las/pdal/extrabytes.las"));
  CHECK(cloud.attribute_as<std::uint16_t>("Colors[0]")[0] == 68);
  CHECK(cloud.attribute_as<std::uint16_t>("Colors[2]")[0] == 88);
  CHECK(cloud.attribute_as<std::int8_t>("Flags[1]").size() == 1065);
  CHECK(cloud.attribute_as<std::uint32_t>("Intensity")[0] == 143);
  CHECK(cloud.attribute_as<std::uint64_t>("Time").size() == 1065);
}
