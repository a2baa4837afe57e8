// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

const std::string head =
    "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
    "0 1 0 0\n-1 0 0 0\n0 0 1 0\n500000 4000000 10 1\n";
/// A quarter of a turn to the left, and two columns of three points, of which one is missing.
const std::string one = "2\n3\n" + head +
                        "1 0 0 0.25 255 0 51\n2 0 0 0.5 0 0 0\n3 0 0 1 0 0 0\n"
                        "4 0 0 0 0 0 0\n0 0 0 0.5 0 0 0\n6 0.5 0 0 1 2 3\n";
const std::string two = one + "1\n1\n" + head + "7 0 0 0.75\n\n";

template <class S, int D = 3>
point_cloud<S, D> read_text_of(std::string_view text) {
  return read_ptx<S, D>(std::as_bytes(std::span{text}), "test.ptx");
}

std::string message_of(std::string_view text) {
  try {
    (void)read_text_of<float>(text);
  } catch (const io_error& error) {
    return error.what();
  }
  return "no error";
}

std::string with(std::string text, std::string_view what, std::string_view by) {
  return text.replace(text.find(what), what.size(), by);
}

}  // namespace

TEST_CASE("the points of a PTX file are where the pose of their scan puts them") {
  const auto cloud = read_text_of<double>(one);
  CHECK(cloud.size() == 5);
  CHECK(cloud.points.col(0) == Eigen::Vector3d(500'000, 4'000'001, 10));
  CHECK(cloud.points.col(4) == Eigen::Vector3d(499'999.5, 4'000'006, 10));
  CHECK(cloud.colors.col(0) == Eigen::Vector3f(1, 0, 0.2f));
  CHECK(cloud.attribute_as<double>("intensity")[2] == 1);
  CHECK(cloud.find_attribute("scan") == nullptr);

  const auto far = with(one, "500000 4000000", "500000.1 4000000.1");
  const auto narrow = read_text_of<float>(far);
  CHECK(narrow.has_origin());
  CHECK(
      ((narrow.points.cast<double>().colwise() + narrow.origin) - read_text_of<double>(far).points)
          .isZero(1e-6));
  const auto flat = read_text_of<double, 2>(one);
  CHECK(flat.points == cloud.points.topRows(2));
  CHECK(flat.attribute_as<double>("z")[0] == 10);
}

TEST_CASE("of several scans in a PTX file, each point knows its own") {
  const auto cloud = read_text_of<double>(two);
  CHECK(cloud.size() == 6);
  CHECK(cloud.attribute_as<std::int32_t>("scan")[4] == 0);
  CHECK(cloud.attribute_as<std::int32_t>("scan")[5] == 1);
  CHECK(cloud.colors.col(5).isZero());
}

TEST_CASE("each scan of a PTX file by itself is organised, row by row, with its pose") {
  const test::temporary_folder folder;
  test::write_file(folder / "a.ptx", two);
  const auto scans = read_ptx_scans<float>(folder / "a.ptx");
  REQUIRE(scans.size() == 2);
  const auto& cloud = scans[0].cloud;
  CHECK(cloud.width == 2);
  CHECK(cloud.height == 3);
  CHECK(cloud.points(0, 0) == 1);
  CHECK(cloud.points(0, 1) == 4);
  CHECK(cloud.points(0, 2) == 2);
  CHECK(std::isnan(cloud.points(0, 3)));
  CHECK(cloud.points(0, 5) == 6);
  CHECK(cloud.attribute_as<double>("intensity")[3] == 0.5);
  CHECK(scans[0].pose.translation() == Eigen::Vector3d(500'000, 4'000'000, 10));
  CHECK((scans[0].pose * Eigen::Vector3d(1, 0, 0)) == Eigen::Vector3d(500'000, 4'000'001, 10));
  CHECK(!scans[1].cloud.has_colors());
}

TEST_CASE("what is wrong with a PTX file is said, with the line") {
  CHECK(message_of("") == "test.ptx, line 0: the file has no scan");
  CHECK(message_of("2\n") == "test.ptx, line 1: the file ends in the middle of a scan");
  CHECK(message_of("x y z\n") == "test.ptx, line 1: \"x y z\" is no number of columns");
  CHECK(message_of("-2\n3\n") == "test.ptx, line 1: \"-2\" is no number of columns");
  CHECK(message_of(with(one, "0 1 0\n", "0 1\n")) == "test.ptx, line 5: there are too few numbers");
  CHECK(message_of(with(one, "10 1\n", "10 2\n")) ==
        "test.ptx, line 10: the last column of the transform is not 0 0 0 1");
  CHECK(message_of(with(one, "10 1\n", "nan 1\n")) ==
        "test.ptx, line 10: the transform has numbers that are not finite");
  CHECK(
      message_of(with(one, "2\n3\n", "1000000\n1000000\n")) ==
      "test.ptx, line 10: the scan promises 1000000000000 points, for which the file is too short");
  CHECK(message_of(with(one, "2\n3\n", "2\n4\n")) ==
        "test.ptx, line 16: the file ends in the middle of a scan");
  CHECK(message_of(with(one, "255 0 51", "256 0 51")) ==
        "test.ptx, line 11: \"256\" is no colour from 0 to 255");
  CHECK(message_of(with(one, "255 0 51", "255 0 51 1")) ==
        "test.ptx, line 11: a point has more than seven numbers");
  CHECK(message_of(with(one, "255 0 51", "255 0")) ==
        "test.ptx, line 11: \"\" is no colour from 0 to 255");
  CHECK(message_of(with(one, "0.25", "half")) == "test.ptx, line 11: \"half\" is no number");
}

TEST_CASE("a PTX file cut anywhere, or with any bit flipped, is a cloud or an error") {
  for (std::size_t n = 0; n < two.size(); ++n) (void)message_of(two.substr(0, n));
  for (std::size_t bit = 0; bit < 8 * two.size(); ++bit) {
    auto bad = two;
    bad[bit / 8] = static_cast<char>(static_cast<unsigned char>(bad[bit / 8]) ^ (1u << bit % 8));
    (void)message_of(bad);
  }
}
