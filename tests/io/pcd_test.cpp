// SPDX-License-Identifier: MIT
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

constexpr pcd_format formats[] = {pcd_format::ascii, pcd_format::binary,
                                  pcd_format::binary_compressed};

template <class T>
auto full_cloud(index_t count) {
  point_cloud<typename T::scalar, T::static_dimension> cloud;
  cloud.points = test::random_points<T>(count, 1, -100, 100);
  cloud.normals = test::random_points<T>(count, 2);
  cloud.colors = Eigen::Matrix3Xf(3, count);
  std::vector<std::int8_t> a;
  std::vector<std::uint16_t> b;
  std::vector<std::int64_t> c;
  std::vector<std::uint64_t> d;
  std::vector<double> e;
  std::vector<float> f[3];
  for (index_t i = 0; i < count; ++i) {
    for (index_t k = 0; k < 3; ++k) cloud.colors(k, i) = float((i * 7 + k * 31) % 256) / 255.0f;
    a.push_back(std::int8_t(i));
    b.push_back(std::uint16_t(i * 1000));
    c.push_back(std::numeric_limits<std::int64_t>::min() + i);
    d.push_back(std::numeric_limits<std::uint64_t>::max() - std::uint64_t(i));
    e.push_back(double(i) / 3);
    for (auto& values : f) values.push_back(float(i) / 7);
  }
  cloud.set_attribute("ring", std::move(a));
  cloud.set_attribute("intensity", std::move(b));
  cloud.set_attribute("stamp", std::move(c));
  cloud.set_attribute("id", std::move(d));
  cloud.set_attribute("time", std::move(e));
  for (int k = 0; k < 3; ++k)
    cloud.set_attribute("shape[" + std::to_string(k) + ']', std::move(f[k]));
  cloud.comments = {"from a test", "VIEWPOINT 1 2 3 0.5 0.5 0.5 0.5"};
  return cloud;
}

point_cloud<float, 3> read_text_of(std::string_view text, const read_options& options = {}) {
  return read_pcd<float>(std::as_bytes(std::span{text}), "test.pcd", options);
}

std::string message_of(std::string_view text) {
  try {
    (void)read_text_of(text);
  } catch (const io_error& error) {
    return error.what();
  }
  return "no error";
}

std::string ascii(std::string_view fields, std::string_view rest) {
  return "VERSION .7\nFIELDS " + std::string{fields} + '\n' + std::string{rest};
}

const std::string three = ascii("x y z",
                                "SIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n"
                                "POINTS 2\nDATA ascii\n");

}  // namespace

TEST_CASE_TEMPLATE("what is written as PCD is read back to the bit, in every format", T,
                   CLOUD_SPACES) {
  const test::temporary_folder folder;
  for (const index_t count : {0, 1, 700, 30000}) {
    const auto cloud = full_cloud<T>(count);
    for (const auto format : formats) {
      write_pcd(cloud, folder / "a.pcd", {.format = format});
      const auto back = read_pcd<typename T::scalar, T::static_dimension>(folder / "a.pcd");
      CHECK(back.points == cloud.points);
      CHECK(back.normals == cloud.normals);
      CHECK(back.colors == cloud.colors);
      CHECK(back.attributes == cloud.attributes);
      CHECK(back.comments == cloud.comments);
    }
  }
}

TEST_CASE_TEMPLATE("odd numbers survive a PCD file: NaN, -0, denormals, the largest", T,
                   CLOUD_SPACES) {
  using S = typename T::scalar;
  const test::temporary_folder folder;
  point_cloud<S, T::static_dimension> cloud{.points = test::random_points<T>(7)};
  using limits = std::numeric_limits<S>;
  const S odd[] = {limits::quiet_NaN(),  limits::infinity(), -limits::infinity(), -S(0),
                   limits::denorm_min(), limits::max(),      limits::lowest()};
  for (index_t i = 0; i < 7; ++i) cloud.points(1, i) = odd[i];
  for (const auto format : formats) {
    write_pcd(cloud, folder / "a.pcd", {.format = format});
    const auto back = read_pcd<S, T::static_dimension>(folder / "a.pcd");
    CHECK(test::same_bits(back.points, cloud.points));
    CHECK(std::signbit(back.points(1, 3)));
  }
}

TEST_CASE("an organised cloud keeps its width and height, also with holes in it") {
  const test::temporary_folder folder;
  point_cloud<float, 3> cloud{.points = test::random_points<test::f3>(12), .width = 4, .height = 3};
  cloud.points.col(5).setConstant(test::nan<float>);
  for (const auto format : formats) {
    write_pcd(cloud, folder / "a.pcd", {.format = format});
    const auto back = read_pcd<float>(folder / "a.pcd");
    CHECK((back.width == 4 && back.height == 3));
    CHECK(test::same_bits(back.points, cloud.points));
  }
}

TEST_CASE("colors come packed as an integer, as the bits of a float, or apart") {
  const auto header = [](const char* fields, const char* sizes, const char* types) {
    return ascii(fields, std::string{"SIZE 4 4 4 "} + sizes + "\nTYPE F F F " + types +
                             "\nWIDTH 1\nHEIGHT 1\nDATA ascii\n");
  };
  const auto is_right = [](const point_cloud<float, 3>& cloud) {
    CHECK(cloud.colors.col(0) == Eigen::Vector3f{1, 128.0f / 255, 0});
  };
  is_right(read_text_of(header("x y z rgb", "4", "U") + "1 2 3 16744448\n"));
  is_right(read_text_of(header("x y z red green blue", "1 1 1", "U U U") + "1 2 3 255 128 0\n"));
  const float bits = std::bit_cast<float>(std::uint32_t{16744448});
  const test::temporary_folder folder;
  std::string text = header("x y z rgb", "4", "F");
  text.replace(text.find("ascii"), 5, "binary");
  const float values[] = {1, 2, 3, bits};
  text.append(reinterpret_cast<const char*>(values), sizeof values);
  is_right(read_text_of(text));
  const auto with_alpha = read_text_of(header("x y z rgba", "4", "U") + "1 2 3 2181005312\n");
  is_right(with_alpha);
  CHECK(with_alpha.attribute_as<std::uint8_t>("alpha")[0] == 129);
}

TEST_CASE("old versions, counts, padding, capital letters and commas are read") {
  const auto old = read_text_of(
      "# made long ago\nVERSION .5\nCOLUMNS x y z\nSIZE 4 4 4\n"
      "TYPE F F F\nPOINTS 1\nDATA ascii\n1 2 3\n");
  CHECK(old.points.col(0) == Eigen::Vector3f{1, 2, 3});
  CHECK(old.comments == std::vector<std::string>{"made long ago"});
  const auto padded =
      read_text_of(ascii("X Y Z _ h",
                         "SIZE 8 8 8 1 2\nTYPE F F F U I\nCOUNT 1 1 1 3 2\nWIDTH 1\nHEIGHT 1\n"
                         "DATA ascii\n1,2,3 , 7 7 7, -5,6\n"));
  CHECK(padded.points.col(0) == Eigen::Vector3f{1, 2, 3});
  REQUIRE(padded.attributes.size() == 2);
  CHECK(padded.attribute_as<std::int16_t>("h[0]")[0] == -5);
  CHECK(padded.attribute_as<std::int16_t>("h[1]")[0] == 6);
}

TEST_CASE("coordinates of a map are read with an origin, and written back") {
  const test::temporary_folder folder;
  point_cloud<double, 3> map;
  map.points = test::random_points<test::d3>(200, 4, -50, 50);
  map.points.row(0).array() += 500000;
  map.points.row(1).array() += 4600000;
  const auto world = [](const auto& cloud) {
    return Eigen::Matrix3Xd{cloud.points.template cast<double>().colwise() + cloud.full_origin()};
  };
  for (const std::string name : {"a.pcd", "a.ply", "a.xyz"}) {
    CAPTURE(name);
    write_cloud(map, folder / name);
    const auto small = read_cloud<float>(folder / name);
    CHECK(small.has_origin());
    CHECK(small.points.cwiseAbs().maxCoeff() < 101);
    CHECK((world(small) - map.points).cwiseAbs().maxCoeff() < 1e-5);
    CHECK(read_cloud<double>(folder / name).points == map.points);
    CHECK(read_cloud<float>(folder / name, {.origin = origin_policy::none}).points ==
          map.points.cast<float>());
    write_cloud(small, folder / name);
    const auto again = read_cloud<float>(folder / name);
    CHECK(again.origin == small.origin);
    CHECK((again.points - small.points).cwiseAbs().maxCoeff() < 1e-8f);
    CHECK(again.comments == small.comments);
    CHECK((world(read_cloud<double>(folder / name, {.origin = origin_policy::none})) - world(small))
              .cwiseAbs()
              .maxCoeff() < 1e-9);
  }
}

TEST_CASE("a PCD header that is wrong is refused with its line") {
  const auto names = [](std::string_view text, const char* what) {
    const auto message = message_of(text);
    CAPTURE(message);
    CHECK(message.find(what) != std::string::npos);
  };
  names("", "line 0: the file ends before a line DATA");
  names("ply\nformat ascii 1.0\n", "line 1: \"ply\" is no word of a PCD header");
  names(ascii("x y z", "SIZE 4 4\nTYPE F F F\nPOINTS 1\nDATA ascii\n"), "one SIZE");
  names(ascii("x y z", "SIZE 4 4 3\nTYPE F F F\nPOINTS 1\nDATA ascii\n"), "no type F of size 3");
  names(ascii("x y x", "SIZE 4 4 4\nTYPE F F F\nPOINTS 1\nDATA ascii\n"), "\"x\" comes twice");
  names(ascii("x y w", "SIZE 4 4 4\nTYPE F F F\nPOINTS 1\nDATA ascii\n"), "no x, y and z");
  names(ascii("x y z", "SIZE 4 4 4\nTYPE F F F\nDATA ascii\n"), "how many points");
  names(ascii("x y z", "SIZE 4 4 4\nTYPE F F F\nWIDTH 3\nHEIGHT 2\nPOINTS 5\nDATA ascii\n"),
        "POINTS is not WIDTH times HEIGHT");
  names(ascii("x y z", "SIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 99999999\nPOINTS 1\nDATA ascii\n"),
        "\"z\" has too many values");
  names(ascii("x y z", "SIZE 4 4 4\nTYPE F F F\nPOINTS -1\nDATA ascii\n"), "POINTS is no number");
  names(ascii("x y z", "SIZE 4 4 4\nTYPE F F F\nPOINTS 1\nDATA hex\n"), "none of ascii");
  names("VERSION 7\n", "the version of the format");
  names(ascii("x y z", "VIEWPOINT 1 2\n"), "seven numbers");
}

TEST_CASE("PCD data that are wrong are refused with their place") {
  const auto names = [](std::string_view text, const char* what) {
    const auto message = message_of(text);
    CAPTURE(message);
    CHECK(message.find(what) != std::string::npos);
  };
  names(three + "1.25 2.25 3.25\n", "line 10: the file ends before all points were read");
  names(three + "1.25 2.25 3.25\n4 5\n", "line 11: the value of \"z\" is missing");
  names(three + "1 2 3\n4 five 6\n", "line 11: \"five\" is no value of \"y\"");
  names(three + "1 2 3 4\n5 6 7\n", "line 10: there are more values than fields");
  CHECK(message_of(three + "1 2 3\n\n# a remark\n4 5 6\nand more\n") == "no error");
  std::string huge = three;
  huge.replace(huge.find("WIDTH 2"), 7, "WIDTH 2000000000");
  huge.replace(huge.find("POINTS 2"), 8, "POINTS 2000000000");
  names(huge + "1 2 3\n", "the header promises 2000000000 points");
  huge.replace(huge.find("ascii"), 5, "binary");
  names(huge + "1 2 3\n", "the header promises 2000000000 points");
  huge.replace(huge.find("binary"), 6, "binary_compressed");
  names(huge + "12345678 a", "which are not those of all points");
}

TEST_CASE("compressed data that are damaged are refused, not believed") {
  const test::temporary_folder folder;
  auto cloud = full_cloud<test::f3>(300);
  write_pcd(cloud, folder / "a.pcd", {.format = pcd_format::binary_compressed});
  const auto good = test::read_file(folder / "a.pcd");
  const auto data = good.find("binary_compressed\n") + 18;
  for (std::size_t at = 0; at < good.size(); at += at < data + 64 ? 1 : 37)
    for (const char change : {'\x00', '\xff', '\x20'}) {
      auto bad = good;
      bad[at] = change;
      try {
        (void)read_text_of(bad);
      } catch (const io_error&) {
      }
      if (at >= data) CHECK(message_of(good.substr(0, at)) != "no error");
    }
}

TEST_CASE("what PCD cannot hold is refused, and no file appears") {
  const test::temporary_folder folder;
  auto cloud = full_cloud<test::f3>(3);
  cloud.set_attribute("two words", std::vector<float>(3));
  CHECK_THROWS_AS(write_pcd(cloud, folder / "a.pcd"), invalid_input);
  cloud = full_cloud<test::f3>(3);
  cloud.set_attribute("_", std::vector<float>(3));
  CHECK_THROWS_AS(write_pcd(cloud, folder / "a.pcd"), invalid_input);
  cloud = full_cloud<test::f3>(3);
  cloud.set_attribute("rgb", std::vector<float>(3));
  CHECK_THROWS_AS(write_pcd(cloud, folder / "a.pcd"), invalid_input);
  CHECK(folder.count() == 0);
  CHECK_THROWS_AS(write_pcd(full_cloud<test::f3>(3), folder / "none" / "a.pcd"), io_error);
  CHECK_THROWS_AS(write_ply(full_cloud<test::f3>(3), folder / "a.ply"), invalid_input);
  CHECK(folder.count() == 0);
}

TEST_CASE("reading and writing PCD report their progress, and can be stopped") {
  const test::temporary_folder folder;
  const auto cloud = full_cloud<test::f3>(20000);
  for (const auto format : formats) {
    std::vector<double> shares;
    const task_monitor watching{.progress = [&](double s) { shares.push_back(s); }};
    write_pcd(cloud, folder / "a.pcd", {.format = format, .monitor = watching});
    CHECK(shares.back() == 1);
    shares.clear();
    (void)read_pcd<float>(folder / "a.pcd", {.monitor = watching});
    CHECK(shares.size() > 1);
    CHECK(shares.back() == 1);
    const auto before = test::read_file(folder / "a.pcd");
    std::stop_source stop;
    stop.request_stop();
    const task_monitor stopping{.stop = stop.get_token()};
    CHECK_THROWS_AS(write_pcd(cloud, folder / "a.pcd", {.format = format, .monitor = stopping}),
                    cancelled);
    CHECK(test::read_file(folder / "a.pcd") == before);
    CHECK(folder.count() == 1);
    CHECK_THROWS_AS((void)read_pcd<float>(folder / "a.pcd", {.monitor = stopping}), cancelled);
  }
}
