// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "e57_bytes.hpp"
#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;
using test::put;

namespace {

const std::string real_places =
    "<cartesianX type=\"Float\"/><cartesianY type=\"Float\"/><cartesianZ type=\"Float\"/>";

template <class S, int D = 3>
point_cloud<S, D> read_bytes(std::string_view bytes) {
  return read_e57<S, D>(std::as_bytes(std::span{bytes}), "test.e57");
}

std::string message_of(std::string_view bytes) {
  try {
    (void)read_bytes<float>(bytes);
  } catch (const io_error& error) {
    return error.what();
  }
  return "no error";
}

/// A file of the points (i, 2 i, 3 i).
std::string simple(std::size_t count, const std::string& more = "") {
  std::vector<double> x, y, z;
  for (std::size_t i = 0; i < count; ++i) {
    x.push_back(double(i));
    y.push_back(2 * double(i));
    z.push_back(3 * double(i));
  }
  test::e57::file made;
  const auto at = made.add_points({test::e57::raw(x), test::e57::raw(y), test::e57::raw(z)});
  return made.bytes(test::e57::scan(at, count, real_places, more));
}

/// With another number or text in the content, and checksums that fit.
std::string with(const std::string& file, std::size_t at, const std::string& bytes) {
  auto content = test::e57::file::content_of(file);
  content.replace(at, bytes.size(), bytes);
  return test::e57::file::paged(content);
}
std::string with(const std::string& file, std::string_view what, const std::string& by) {
  return with(file, test::e57::file::content_of(file).find(what), by);
}

}  // namespace

TEST_CASE("cartesian points of an E57 file, in many packets over many pages") {
  const auto cloud = read_bytes<double>(simple(1000));
  CHECK(cloud.size() == 1000);
  for (const index_t i : {0, 1, 500, 999})
    CHECK(cloud.points.col(i) == Eigen::Vector3d(double(i), 2.0 * double(i), 3.0 * double(i)));
  const auto flat = read_bytes<float, 2>(simple(10));
  CHECK(flat.points.col(9) == Eigen::Vector2f(9, 18));
  CHECK(flat.attribute_as<double>("z")[9] == 27);
  CHECK(read_bytes<float>(simple(0)).empty());
}

TEST_CASE("integers of any number of bits, cut anywhere by packets, are scaled and shifted") {
  random_stream random{1};
  for (const unsigned bits : {1u, 3u, 8u, 13u, 31u, 33u, 47u}) {
    CAPTURE(bits);
    std::vector<std::uint64_t> raw;
    test::e57::bits packed{bits};
    for (int i = 0; i < 300; ++i) {
      raw.push_back(static_cast<std::uint64_t>(random.uniform(0, std::ldexp(1.0, int(bits)))));
      packed.add(raw.back());
    }
    const std::int64_t low = -1000;
    const auto high = low + (std::int64_t{1} << bits) - 1;
    const std::string limits =
        " minimum=\"" + std::to_string(low) + "\" maximum=\"" + std::to_string(high) + '"';
    test::e57::file made;
    const auto at = made.add_points({packed.bytes(), packed.bytes(), ""}, 7);
    const auto cloud = read_bytes<double>(made.bytes(test::e57::scan(
        at, 300,
        "<cartesianX type=\"ScaledInteger\"" + limits + " scale=\"0.5\" offset=\"100\"/>" +
            "<cartesianY type=\"Integer\"" + limits + "/>" +
            "<cartesianZ type=\"Integer\" minimum=\"7\" maximum=\"7\"/>")));
    REQUIRE(cloud.size() == 300);
    bool same = true;
    for (index_t i = 0; i < 300; ++i) {
      const double value = double(raw[static_cast<std::size_t>(i)]) - 1000;
      same = same && cloud.points.col(i) == Eigen::Vector3d(value * 0.5 + 100, value, 7);
    }
    CHECK(same);
  }
}

TEST_CASE("spherical points, those without an echo left out") {
  test::e57::file made;
  const double right = std::numbers::pi / 2;
  const auto at = made.add_points({test::e57::raw(std::vector<double>{2, 3, 4}),
                                   test::e57::raw(std::vector<double>{0, right, 0}),
                                   test::e57::raw(std::vector<double>{0, 0, right}),
                                   test::e57::bits{2}.add(0).add(2).add(0).bytes()});
  const auto cloud = read_bytes<double>(made.bytes(
      test::e57::scan(at, 3,
                      "<sphericalRange type=\"Float\"/><sphericalAzimuth type=\"Float\"/>"
                      "<sphericalElevation type=\"Float\"/>"
                      "<sphericalInvalidState type=\"Integer\" minimum=\"0\" maximum=\"2\"/>")));
  REQUIRE(cloud.size() == 2);
  CHECK((cloud.points - Eigen::Matrix<double, 3, 2>{{2, 0}, {0, 0}, {0, 4}}).isZero(1e-12));
  CHECK(cloud.attributes.empty());
}

TEST_CASE("several scans of an E57 file, each with its pose and its values") {
  const test::temporary_folder folder;
  test::e57::file made;
  const auto one = std::vector<float>{1}, two = std::vector<float>{2},
             three = std::vector<float>{3};
  const auto raw = [](const auto& v) { return test::e57::raw(v); };
  const auto first = made.add_points(
      {raw(one), raw(two), raw(three), std::string{"\x80"}, test::e57::bits{10}.add(600).bytes()});
  const auto second =
      made.add_points({raw(one), raw(two), raw(three), raw(std::vector<float>{0.5f})});
  const std::string places =
      "<cartesianX type=\"Float\" precision=\"single\"/><cartesianY type=\"Float\" "
      "precision=\"single\"/><cartesianZ type=\"Float\" precision=\"single\"/>";
  const auto bytes = made.bytes(
      test::e57::scan(first, 1,
                      places + "<colorRed type=\"Integer\" minimum=\"0\" maximum=\"255\"/>"
                               "<rowIndex type=\"Integer\" minimum=\"0\" maximum=\"1000\"/>",
                      "<name type=\"String\"><![CDATA[one & <only>]]></name>"
                      "<pose type=\"Structure\"><rotation type=\"Structure\"><w>0.5</w><z>0.5</z>"
                      "</rotation><translation><x>100</x><y/></translation></pose>") +
      test::e57::scan(second, 1, places + "<intensity type=\"Float\" precision=\"single\"/>"));
  const auto cloud = read_bytes<double>(bytes);
  REQUIRE(cloud.size() == 2);
  CHECK((cloud.points.col(0) - Eigen::Vector3d(98, 1, 3)).isZero(1e-12));
  CHECK(cloud.points.col(1) == Eigen::Vector3d(1, 2, 3));
  CHECK(cloud.attribute_as<std::int32_t>("scan")[1] == 1);
  CHECK(cloud.attribute_as<std::uint16_t>("row_index")[0] == 600);
  CHECK(cloud.attribute_as<std::uint16_t>("row_index")[1] == 0);
  CHECK(std::isnan(cloud.attribute_as<float>("intensity")[0]));
  CHECK(cloud.attribute_as<float>("intensity")[1] == 0.5f);

  test::write_file(folder / "a.e57", bytes);
  const auto scans = read_e57_scans<float>(folder / "a.e57");
  REQUIRE(scans.size() == 2);
  CHECK(scans[0].name == "one & <only>");
  CHECK(scans[0].cloud.points.col(0) == Eigen::Vector3f(1, 2, 3));
  CHECK((scans[0].pose * Eigen::Vector3d(1, 2, 3) - Eigen::Vector3d(98, 1, 3)).isZero(1e-12));
  CHECK(scans[1].pose.matrix().isIdentity());
  CHECK(scans[1].cloud.attribute_as<float>("intensity")[0] == 0.5f);
  CHECK(read_cloud<double>(folder / "a.e57").points == cloud.points);
}

TEST_CASE("colours of an E57 file are scaled by their limits") {
  test::e57::file made;
  const std::string zero = test::e57::raw(std::vector<double>{0, 0});
  const auto channel = test::e57::bits{12}.add(1000).add(4000).bytes();
  const auto at = made.add_points({zero, zero, zero, channel, channel, channel});
  std::string prototype = real_places;
  for (const char* name : {"Red", "Green", "Blue"})
    prototype +=
        std::string{"<color"} + name + " type=\"Integer\" minimum=\"0\" maximum=\"4095\"/>";
  const std::string limits =
      "<colorLimits><colorGreenMinimum>0</colorGreenMinimum><colorGreenMaximum>2000"
      "</colorGreenMaximum></colorLimits>";
  const auto cloud = read_bytes<float>(made.bytes(test::e57::scan(at, 2, prototype, limits)));
  CHECK(cloud.colors.col(0).isApprox(Eigen::Vector3f(1000 / 4095.0f, 0.5f, 1000 / 4095.0f)));
  CHECK(cloud.colors(1, 1) == 1);
}

TEST_CASE("a page whose checksum does not fit is named") {
  auto bytes = simple(1000);
  bytes[7 * 1024 + 100] ^= 1;
  CHECK(message_of(bytes) == "test.e57, byte 7168: page 7 is damaged: its checksum does not fit");
  bytes = simple(1000);
  bytes[1023] ^= 1;
  CHECK(message_of(bytes) == "test.e57, byte 0: page 0 is damaged: its checksum does not fit");
}

TEST_CASE("what is wrong with an E57 file is said") {
  const auto good = simple(100);
  CHECK(message_of(good) == "no error");
  CHECK(message_of("ply") ==
        "test.e57, byte 0: the file does not begin with ASTM-E57: this is not an E57 file");
  const auto eight = [](std::uint64_t value) {
    std::string bytes(8, '\0');
    put(bytes, 0, value);
    return bytes;
  };
  CHECK(message_of(with(good, 8, "\2")) == "test.e57, byte 8: version 2 of E57 is not known");
  CHECK(message_of(with(good, 40, eight(512))) ==
        "test.e57, byte 40: the pages have 512 bytes instead of 1024");
  CHECK(message_of(good.substr(0, good.size() - 1024)).find("the header promises ") !=
        std::string::npos);
  CHECK(message_of(with(good, 24, eight(1 << 30))) ==
        "test.e57, byte 1073741824: the file refers to byte 1073741824, where it has no data");
  CHECK(message_of(with(good, 32, eight(1 << 30))).find("the file ends in the middle") !=
        std::string::npos);
  CHECK(message_of(with(good, "recordCount=\"100\"", "recordCount=\"999\""))
            .find("a scan promises 999 points of 192 bits, for which the file is too short") !=
        std::string::npos);
  CHECK(message_of(with(good, "recordCount=\"100\"", "recordCount=\"101\"")) ==
        "test.e57, byte 48: a scan promises 101 points, and 100 are there");
  CHECK(message_of(with(good, "recordCount=\"100\"", "recordCount=\"-10\""))
            .find("a negative number of points") != std::string::npos);
  CHECK(message_of(with(good, "cartesianZ", "cartesianQ"))
            .find("the points of a scan have no coordinates") != std::string::npos);
  CHECK(message_of(with(good, "\"Float\"", "\"Flout\""))
            .find("is of the type \"Flout\", which a value of a point cannot be") !=
        std::string::npos);
  CHECK(message_of(with(good, "</data3D>", "</data4D>"))
            .find("the XML part is malformed: the element data3D ends under another name") !=
        std::string::npos);
  CHECK(message_of(with(good, "<!-- made", "<!DOCTYPE")).find("it declares types") !=
        std::string::npos);
  CHECK(message_of(with(good, 48, "\5")) == "test.e57, byte 48: the points do not begin as such");
  CHECK(message_of(with(good, 96, "\7")) == "test.e57, byte 96: a packet of points is malformed");
}

TEST_CASE("scans cannot share their packets, nor XML be deep") {
  std::vector<double> x(100);
  test::e57::file made;
  const auto at = made.add_points({test::e57::raw(x), test::e57::raw(x), test::e57::raw(x)});
  std::string scans;
  for (int i = 0; i < 10; ++i) scans += test::e57::scan(at, 100, real_places);
  CHECK(message_of(made.bytes(scans)).find("the scans have the same packets of points") !=
        std::string::npos);
  std::string deep;
  for (int i = 0; i < 100'000; ++i) deep += "<a>";
  CHECK(message_of(made.bytes(deep)).find("nested too deeply") != std::string::npos);
}

TEST_CASE("reading E57 can be watched and stopped") {
  const test::temporary_folder folder;
  test::write_file(folder / "a.e57", simple(1000));
  std::stop_source source;
  double last = 0;
  const task_monitor watched{.progress = [&](double p) { last = p; }, .stop = source.get_token()};
  CHECK(read_e57<float>(folder / "a.e57", {.monitor = watched}).size() == 1000);
  CHECK(last == 1);
  source.request_stop();
  CHECK_THROWS_AS((void)read_e57<float>(folder / "a.e57", {.monitor = watched}), cancelled);
}

TEST_CASE("an E57 file cut anywhere, or with anything changed, is a cloud or an error") {
  const auto good = simple(5);
  for (std::size_t n = 0; n < good.size(); ++n) CHECK(message_of(good.substr(0, n)) != "no error");
  // Checksums see one bit; the rest has to bear what they do not see.
  for (std::size_t at = 0; at < good.size(); at += 3) {
    auto bad = good;
    bad[at] ^= 4;
    CHECK(message_of(bad) != "no error");
  }
  const auto content = test::e57::file::content_of(good);
  for (std::size_t bit = 0; bit < 8 * content.size(); ++bit) {
    auto bad = content;
    bad[bit / 8] = static_cast<char>(static_cast<unsigned char>(bad[bit / 8]) ^ (1u << bit % 8));
    (void)message_of(test::e57::file::paged(bad));
  }
}
