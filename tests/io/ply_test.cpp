// SPDX-License-Identifier: MIT
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <locale>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

template <class T>
using cloud_of = point_cloud<typename T::scalar, T::static_dimension>;

/// Everything that a file can carry, awkward numbers included.
template <class T>
cloud_of<T> rich_cloud() {
  using S = typename T::scalar;
  using limits = std::numeric_limits<S>;
  cloud_of<T> cloud;
  cloud.points = test::random_points<T>(300, 1, -1e3, 1e3);
  cloud.points.col(0).setConstant(limits::max());
  cloud.points.col(1).setConstant(-limits::denorm_min());
  cloud.points.col(2).setConstant(-0.0);
  cloud.points.col(3).setConstant(S(0.1));
  cloud.normals = test::random_points<T>(300, 2);
  cloud.colors.resize(3, 300);
  for (index_t i = 0; i < 300; ++i)
    cloud.colors.col(i) = Eigen::Vector3f{float(i % 256), float((i * 7) % 256), 255} / 255;
  const auto add = [&]<class V>(const char* name, V low, V high) {
    std::vector<V> values(300);
    for (index_t i = 0; i < 300; ++i) values[std::size_t(i)] = i % 2 == 0 ? low : high;
    cloud.set_attribute(name, std::move(values));
  };
  add("a_char", std::int8_t{-128}, std::int8_t{127});
  add("a_uchar", std::uint8_t{0}, std::uint8_t{255});
  add("a_short", std::int16_t{-32768}, std::int16_t{32767});
  add("a_ushort", std::uint16_t{0}, std::uint16_t{65535});
  add("an_int", std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max());
  add("a_uint", std::uint32_t{0}, std::numeric_limits<std::uint32_t>::max());
  add("a_float", 0.1f, 1e-42f);
  add("a_double", 0.1, 5e-324);
  cloud.comments = {"one", "  two, with spaces ", "obj_info three", ""};
  return cloud;
}

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span{text});
}

point_cloud<float, 3> read_text(std::string_view text) {
  return read_ply<float>(bytes_of(text));
}

}  // namespace

TEST_CASE_TEMPLATE("what is written is read back to the bit, in every format", T, CLOUD_SPACES) {
  const test::temporary_folder folder;
  const auto cloud = rich_cloud<T>();
  for (const ply_format format :
       {ply_format::ascii, ply_format::binary_little_endian, ply_format::binary_big_endian}) {
    for (const bool float_colors : {false, true}) {
      write_ply(cloud, folder / "cloud.ply", {.format = format, .float_colors = float_colors});
      const auto again = read_ply<typename T::scalar, T::static_dimension>(folder / "cloud.ply");
      CHECK(again == cloud);
      CHECK(std::signbit(again.points(0, 2)));
    }
  }
  CHECK(folder.count() == 1);
}

TEST_CASE_TEMPLATE("values that are not finite survive a file", T, CLOUD_SPACES) {
  using S = typename T::scalar;
  const test::temporary_folder folder;
  cloud_of<T> cloud;
  cloud.points = test::random_points<T>(3);
  cloud.points(0, 0) = test::nan<S>;
  cloud.points(1, 1) = test::infinity<S>;
  cloud.points(0, 2) = -test::infinity<S>;
  for (const ply_format format : {ply_format::ascii, ply_format::binary_big_endian}) {
    write_ply(cloud, folder / "cloud.ply", {.format = format});
    const auto again = read_ply<S, T::static_dimension>(folder / "cloud.ply");
    CHECK(test::same_bits(again.points, cloud.points));
  }
}

TEST_CASE("no points and one point are read back") {
  const test::temporary_folder folder;
  for (const index_t n : {0, 1})
    for (const ply_format format : {ply_format::ascii, ply_format::binary_little_endian}) {
      const point_cloud<double, 3> cloud{.points = test::random_points<test::d3>(n)};
      write_ply(cloud, folder / "cloud.ply", {.format = format});
      CHECK(read_ply<double>(folder / "cloud.ply").points == cloud.points);
    }
}

TEST_CASE("a text file is read as it stands") {
  const auto cloud = read_text(
      "ply\n"
      "format ascii 1.0\n"
      "comment made by hand\n"
      "obj_info and by eye\n"
      "element vertex 2\n"
      "property float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n"
      "property int label\n"
      "element face 1\n"
      "property list uchar int vertex_indices\n"
      "end_header\n"
      "1 2 3 255 0 51 128 -7\n"
      "  -4.5e1\t+5 .6  0 0 0 0 8\n"
      "3 0 1 2\n");
  CHECK(cloud.points == Eigen::Matrix<float, 3, 2>{{1, -45}, {2, 5}, {3, 0.6f}});
  CHECK(cloud.colors.col(0) == Eigen::Vector3f{1, 0, 0.2f});
  CHECK(cloud.attribute_as<std::uint8_t>("alpha")[0] == 128);
  CHECK(cloud.attribute_as<std::int32_t>("label")[0] == -7);
  CHECK(cloud.attributes.size() == 2);
  CHECK_FALSE(cloud.has_normals());
  CHECK(cloud.comments == std::vector<std::string>{"made by hand", "obj_info and by eye"});
}

TEST_CASE("triangles are written as faces, which readers of points pass over") {
  const test::temporary_folder folder;
  const auto path = folder / "faces.ply";
  const point_cloud<float, 2> cloud{.points = Eigen::Matrix<float, 2, 3>{{0, 1, 0}, {0, 0, 1}}};
  write_ply(cloud, path,
            {.format = ply_format::ascii, .triangles = Eigen::Matrix3Xi{{0, 2}, {1, 1}, {2, 0}}});
  CHECK(
      test::read_file(path).ends_with("element face 2\n"
                                      "property list uchar int vertex_indices\n"
                                      "end_header\n0 0\n1 0\n0 1\n3 0 1 2\n3 2 1 0\n"));
  CHECK(read_ply<float, 2>(path) == cloud);
  using namespace std::literals;
  write_ply(cloud, path,
            {.format = ply_format::binary_big_endian, .triangles = Eigen::Vector3i{0, 1, 2}});
  CHECK(test::read_file(path).ends_with("\3\0\0\0\0\0\0\0\1\0\0\0\2"sv));
  CHECK(read_ply<float, 2>(path) == cloud);
  write_ply(cloud, path, {.triangles = Eigen::Vector3i{0, 1, 2}});
  CHECK(test::read_file(path).ends_with("\3\0\0\0\0\1\0\0\0\2\0\0\0"sv));
  CHECK_THROWS_AS(write_ply(cloud, path, {.triangles = Eigen::Vector3i{0, 1, 3}}), invalid_input);
  CHECK_THROWS_AS(write_ply(cloud, path, {.triangles = Eigen::Vector3i{0, -1, 2}}), invalid_input);
  CHECK_THROWS_AS(write_ply(cloud, path, {.triangles = Eigen::Vector2i{0, 1}}), invalid_input);
  CHECK(test::read_file(path).ends_with("\3\0\0\0\0\1\0\0\0\2\0\0\0"sv));
}

TEST_CASE("properties may come in any order and of any type") {
  const auto cloud = read_text(
      "ply\nformat ascii 1.0\nelement vertex 1\n"
      "property double nz\nproperty uchar z\nproperty int8 x\nproperty float64 ny\n"
      "property short y\nproperty float32 nx\nproperty float red\nproperty double blue\n"
      "property float green\nend_header\n"
      "1 200 -3 0 400 0 0.5 1 0.25\n");
  CHECK(cloud.points.col(0) == Eigen::Vector3f{-3, 400, 200});
  CHECK(cloud.normals.col(0) == Eigen::Vector3f{0, 0, 1});
  CHECK(cloud.colors.col(0) == Eigen::Vector3f{0.5f, 0.25f, 1});
}

TEST_CASE("half a set of normals or colors becomes attributes") {
  const auto cloud = read_text(
      "ply\nformat ascii 1.0\nelement vertex 1\n"
      "property float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty uchar red\nend_header\n1 2 3 4 5 6\n");
  CHECK_FALSE(cloud.has_normals());
  CHECK_FALSE(cloud.has_colors());
  CHECK(cloud.attribute_as<float>("ny")[0] == 5);
  CHECK(cloud.attribute_as<std::uint8_t>("red")[0] == 6);
}

TEST_CASE("lines may end as on Windows, and the data of a binary file begin with a line feed") {
  const auto cloud = read_text(
      "ply\r\nformat ascii 1.0\r\nelement vertex 1\r\nproperty float x\r\nproperty float y\r\n"
      "property float z\r\nend_header\r\n\r\n1 2 3\r\n");
  CHECK(cloud.points.col(0) == Eigen::Vector3f{1, 2, 3});
  std::string binary =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar x\n"
      "property uchar y\nproperty uchar z\nend_header\n";
  binary += "\n\r\n";
  CHECK(read_text(binary).points.col(0) == Eigen::Vector3f{10, 13, 10});
}

TEST_CASE("lists of vertices and elements before the vertices are skipped, in text and in binary") {
  const std::string header =
      "element face 2\nproperty list uchar short indices\nproperty uchar flag\n"
      "element range_grid 1\nproperty int a\nproperty int b\n"
      "element vertex 2\nproperty uchar x\nproperty list ushort float weights\n"
      "property uchar y\nproperty uchar z\nend_header\n";
  const auto expect = [](const point_cloud<float, 3>& cloud) {
    CHECK(cloud.points == Eigen::Matrix<float, 3, 2>{{1, 4}, {2, 5}, {3, 6}});
    CHECK(cloud.attributes.empty());
  };
  expect(read_text("ply\nformat ascii 1.0\n" + header +
                   "3 0 1 2 9\n0 9\n7 8\n1 2 0.5 0.25 2 3\n4 0 5 6\n"));
  std::string little = "ply\nformat binary_little_endian 1.0\n" + header;
  little += std::string{"\3\0\0\1\0\2\0\11", 8} + std::string{"\0\11", 2};
  little += std::string(8, 'x');
  little += std::string{"\1\2\0", 3} + std::string(8, 'w') + "\2\3" + std::string{"\4\0\0\5\6", 5};
  expect(read_text(little));
  std::string big = "ply\nformat binary_big_endian 1.0\n" + header;
  big += std::string{"\3\0\0\0\1\0\2\11", 8} + std::string{"\0\11", 2};
  big += std::string(8, 'x');
  big += std::string{"\1\0\2", 3} + std::string(8, 'w') + "\2\3" + std::string{"\4\0\0\5\6", 5};
  expect(read_text(big));
}

TEST_CASE("numbers are read and written alike under every locale") {
  struct comma : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
  };
  const test::temporary_folder folder;
  point_cloud<double, 2> cloud{.points = Eigen::Vector2d{1234567.5, -0.25}};
  const std::locale before = std::locale::global(std::locale{std::locale::classic(), new comma});
  write_ply(cloud, folder / "cloud.ply", {.format = ply_format::ascii});
  const auto again = read_ply<double, 2>(folder / "cloud.ply");
  std::locale::global(before);
  CHECK(again.points == cloud.points);
  CHECK(test::read_file(folder / "cloud.ply").find("1234567.5 -0.25") != std::string::npos);
}

TEST_CASE("colors are rounded to 8 bits") {
  const test::temporary_folder folder;
  point_cloud<float, 3> cloud{.points = Eigen::Matrix3Xf::Zero(3, 2)};
  cloud.colors.resize(3, 2);
  cloud.colors << 0.0f, 0.5f, 1.0f, 0.001f, -1e-7f, 0.999f;
  write_ply(cloud, folder / "cloud.ply");
  const auto again = read_ply<float>(folder / "cloud.ply");
  CHECK(again.colors.col(0) == Eigen::Vector3f{0, 1, 0});
  CHECK(again.colors.col(1) == Eigen::Vector3f{128, 0, 255} / 255);
}

TEST_CASE("a comment of several lines stays a comment") {
  const test::temporary_folder folder;
  point_cloud<float, 3> cloud{.points = Eigen::Vector3f{1, 2, 3}};
  cloud.comments = {"first\nend_header\r\nlast"};
  write_ply(cloud, folder / "cloud.ply", {.format = ply_format::ascii});
  const auto again = read_ply<float>(folder / "cloud.ply");
  CHECK(again.points == cloud.points);
  CHECK(again.comments == std::vector<std::string>{"first", "end_header", "", "last"});
}

TEST_CASE("what PLY could not tell apart is refused, and no file appears") {
  const test::temporary_folder folder;
  point_cloud<float, 3> cloud{.points = Eigen::Vector3f{1, 2, 3}};
  for (const char* name : {"x", "", "two words", "line\nfeed"}) {
    auto bad = cloud;
    bad.set_attribute(name, std::vector<float>{1});
    CHECK_THROWS_AS(write_ply(bad, folder / "cloud.ply"), invalid_input);
  }
  cloud.normals.resize(3, 2);
  CHECK_THROWS_AS(write_ply(cloud, folder / "cloud.ply"), invalid_input);
  CHECK(folder.count() == 0);
}

TEST_CASE("reading and writing report their progress") {
  const test::temporary_folder folder;
  const point_cloud<float, 3> cloud{.points = test::random_points<test::f3>(100'000)};
  std::vector<double> seen;
  const task_monitor monitor{.progress = [&](double share) { seen.push_back(share); }};
  for (const ply_format format : {ply_format::ascii, ply_format::binary_little_endian}) {
    seen.clear();
    write_ply(cloud, folder / "cloud.ply", {.format = format, .monitor = monitor});
    CHECK((seen.size() > 3 && std::ranges::is_sorted(seen) && seen.back() == 1));
    seen.clear();
    CHECK(read_ply<float>(folder / "cloud.ply", {.monitor = monitor}).size() == 100'000);
    CHECK((seen.size() > 3 && std::ranges::is_sorted(seen) && seen.back() == 1));
  }
}

TEST_CASE("a writer that is stopped leaves the file that was there, and a reader nothing") {
  const test::temporary_folder folder;
  const point_cloud<float, 3> cloud{.points = test::random_points<test::f3>(100'000)};
  write_ply(cloud, folder / "cloud.ply");
  const auto before = test::read_file(folder / "cloud.ply");
  for (const ply_format format : {ply_format::ascii, ply_format::binary_little_endian}) {
    std::stop_source stop;
    const task_monitor monitor{.progress =
                                   [&](double share) {
                                     if (share > 0.3) stop.request_stop();
                                   },
                               .stop = stop.get_token()};
    CHECK_THROWS_AS(write_ply(cloud, folder / "cloud.ply", {.format = format, .monitor = monitor}),
                    cancelled);
    CHECK(test::read_file(folder / "cloud.ply") == before);
    CHECK_THROWS_AS((void)read_ply<float>(folder / "cloud.ply", {.monitor = monitor}), cancelled);
  }
  CHECK(folder.count() == 1);
}
