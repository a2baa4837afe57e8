// SPDX-License-Identifier: MIT
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "las_bytes.hpp"
#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;
using test::las_bytes;
using test::put;

namespace {

constexpr std::array<std::uint16_t, 11> lengths{20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};

template <class S, int D = 3>
point_cloud<S, D> read_bytes(std::string_view bytes, const read_options& options = {}) {
  return read_las<S, D>(std::as_bytes(std::span{bytes}), "test.las", options);
}

std::string message_of(std::string_view bytes) {
  try {
    (void)read_bytes<float>(bytes);
  } catch (const io_error& error) {
    return error.what();
  }
  return "no error";
}

/// Records of random bits, but for floating numbers, which are finite, and coordinates, which float
/// holds.
std::string random_records(int format, std::size_t extra, index_t count) {
  random_stream random{static_cast<std::uint64_t>(format)};
  const auto length = static_cast<std::size_t>(lengths[static_cast<std::size_t>(format)]) + extra;
  std::string all;
  for (index_t i = 0; i < count; ++i) {
    std::string record(length, '\0');
    for (char& c : record) c = static_cast<char>(static_cast<int>(random.uniform(0, 256)));
    for (std::size_t d = 0; d < 3; ++d)
      put(record, 4 * d, static_cast<std::int32_t>(random.uniform(-1e6, 1e6)));
    const bool has_time = format != 0 && format != 2;
    if (has_time) put(record, format >= 6 ? 22 : 20, random.uniform(0, 1e9));
    if (format == 4 || format == 5 || format == 9 || format == 10)
      for (std::size_t k = 0; k < 4; ++k)
        put(record, length - extra - 16 + 4 * k, static_cast<float>(random.uniform(-1, 1)));
    all += record;
  }
  return all;
}

las_bytes file_of(int format, index_t count, std::size_t extra = 0) {
  las_bytes made{.minor = format >= 6   ? 4
                          : format >= 4 ? 3
                                        : 2,
                 .format = format,
                 .record_length =
                     static_cast<std::uint16_t>(lengths[static_cast<std::size_t>(format)] + extra)};
  made.points = random_records(format, extra, count);
  return made;
}

}  // namespace

TEST_CASE_TEMPLATE("points of every format are written again as they were read, byte by byte", S,
                   float, double) {
  const test::temporary_folder folder;
  for (int format = 0; format <= 10; ++format)
    for (const std::size_t extra : {0, 3}) {
      CAPTURE(format);
      CAPTURE(extra);
      const auto made = file_of(format, 3000, extra);
      const auto bytes = made.file();
      const auto cloud = read_bytes<S>(bytes);
      CHECK(cloud.size() == 3000);
      const auto info = las_header(std::as_bytes(std::span{bytes}));
      write_las(cloud, folder / "a.las", {.like = info});
      const auto again = test::read_file(folder / "a.las");
      const auto points_at =
          std::bit_cast<std::uint32_t>(std::array{again[96], again[97], again[98], again[99]});
      CHECK(again.substr(points_at) == made.points);
      const auto back = read_las<S>(folder / "a.las");
      CHECK(back.points == cloud.points);
      CHECK(back.colors == cloud.colors);
      CHECK(back.attributes == cloud.attributes);
      CHECK(back.origin == cloud.origin);
    }
}

TEST_CASE("a file in two dimensions has z as an attribute, and is written with it") {
  const test::temporary_folder folder;
  const auto made = file_of(3, 100);
  const auto bytes = made.file();
  const auto flat = read_bytes<double, 2>(bytes);
  const auto whole = read_bytes<double>(bytes);
  CHECK(flat.points == whole.points.topRows(2));
  CHECK(flat.attribute_as<double>("z")[7] == whole.points(2, 7));
  write_las(flat, folder / "a.las", {.like = las_header(std::as_bytes(std::span{bytes}))});
  CHECK(read_las<double>(folder / "a.las").points == whole.points);
}

TEST_CASE("what the bits of a point mean") {
  las_bytes made{};
  made.points.assign(20, '\0');
  put(made.points, 12, std::uint16_t{4321});
  made.points[14] = static_cast<char>(0b11'101'010);
  made.points[15] = static_cast<char>(0b101'01001);
  made.points[16] = -15;
  made.points[17] = static_cast<char>(200);
  put(made.points, 18, std::uint16_t{777});
  const auto cloud = read_bytes<float>(made.file());
  const auto value = [&](const char* name) { return cloud.attribute_to<double>(name)[0]; };
  CHECK(value("intensity") == 4321);
  CHECK(value("return_number") == 2);
  CHECK(value("number_of_returns") == 5);
  CHECK(value("scan_direction") == 1);
  CHECK(value("edge_of_flight_line") == 1);
  CHECK(value("classification") == 9);
  CHECK(value("synthetic") == 1);
  CHECK(value("key_point") == 0);
  CHECK(value("withheld") == 1);
  CHECK(value("scan_angle") == -15);
  CHECK(value("user_data") == 200);
  CHECK(value("point_source_id") == 777);
  CHECK(cloud.attributes.size() == 12);
}

TEST_CASE("what the bits of a point of format 10 mean") {
  las_bytes made{.minor = 4, .format = 10, .record_length = 67};
  made.points.assign(67, '\0');
  made.points[14] = static_cast<char>(0b1100'1011);
  made.points[15] = static_cast<char>(0b01'10'1001);
  made.points[16] = static_cast<char>(200);
  made.points[17] = 5;
  put(made.points, 18, std::int16_t{-2500});
  put(made.points, 20, std::uint16_t{9});
  put(made.points, 22, 123.5);
  put(made.points, 30, std::uint16_t{65535});
  put(made.points, 36, std::uint16_t{300});
  made.points[38] = 3;
  put(made.points, 39, std::uint64_t{1} << 40);
  put(made.points, 47, std::uint32_t{256});
  put(made.points, 51, 1.5f);
  put(made.points, 63, 0.25f);
  const auto cloud = read_bytes<double>(made.file());
  const auto value = [&](const char* name) { return cloud.attribute_to<double>(name)[0]; };
  CHECK(value("return_number") == 11);
  CHECK(value("number_of_returns") == 12);
  CHECK(value("synthetic") == 1);
  CHECK(value("key_point") == 0);
  CHECK(value("withheld") == 0);
  CHECK(value("overlap") == 1);
  CHECK(value("scanner_channel") == 2);
  CHECK(value("scan_direction") == 1);
  CHECK(value("edge_of_flight_line") == 0);
  CHECK(value("classification") == 200);
  CHECK(value("scan_angle") == doctest::Approx(-15));
  CHECK(value("gps_time") == 123.5);
  CHECK(cloud.colors(0, 0) == 1);
  CHECK(cloud.colors(1, 0) == 0);
  CHECK(value("near_infrared") == 300);
  CHECK(value("wave_descriptor") == 3);
  CHECK(cloud.attribute_as<std::uint64_t>("wave_offset")[0] == std::uint64_t{1} << 40);
  CHECK(value("wave_size") == 256);
  CHECK(value("wave_location") == 1.5);
  CHECK(value("wave_z") == 0.25);
}

TEST_CASE("a scale of 1e-9 and an offset of 5e6 keep every digit in double") {
  const test::temporary_folder folder;
  las_bytes made{.scale = 1e-9, .offset = 5e6};
  made.points.assign(40, '\0');
  put(made.points, 0, std::int32_t{1'234'567'891});
  put(made.points, 20, std::int32_t{1'234'567'892});
  const auto bytes = made.file();
  const auto cloud = read_bytes<double>(bytes);
  CHECK(cloud.origin == Eigen::Vector3d::Constant(5e6));
  CHECK(cloud.points(0, 0) == 1'234'567'891 * 1e-9);
  CHECK(cloud.points(0, 1) - cloud.points(0, 0) == doctest::Approx(1e-9));
  write_las(cloud, folder / "a.las");
  const auto info = las_header(folder / "a.las");
  CHECK(info.scale == Eigen::Vector3d::Constant(1e-9));
  CHECK(info.offset == Eigen::Vector3d::Constant(5e6));
  CHECK(read_las<double>(folder / "a.las").points == cloud.points);

  const auto narrow = read_bytes<float>(bytes);
  CHECK(narrow.origin == Eigen::Vector3d(5'000'001, 5e6, 5e6));
  CHECK(narrow.points(0, 0) == doctest::Approx(0.234567891).epsilon(1e-6));
  CHECK(!read_bytes<float>(bytes, {.origin = origin_policy::none}).has_origin());
}

TEST_CASE("coordinates of maps get an origin in float, and none in double") {
  las_bytes made{.scale = 0.001, .offset = 600'000};
  for (int i = 0; i < 5; ++i) {
    std::string record(20, '\0');
    put(record, 0, std::int32_t{1000 * i});
    made.points += record;
  }
  // A single point that strays does not take the others with it.
  put(made.points, 0, std::int32_t{-2'000'000'000});
  const auto narrow = read_bytes<float>(made.file());
  CHECK(narrow.origin == Eigen::Vector3d(600'002, 600'000, 600'000));
  CHECK(narrow.points(0, 3) == 1);
  const auto wide = read_bytes<double>(made.file());
  CHECK(!wide.has_origin());
  CHECK(wide.points(0, 3) == doctest::Approx(600'003).epsilon(1e-15));
}

TEST_CASE("16-bit colours of which none is above 255 are of 8 bits") {
  las_bytes made{.format = 2, .record_length = 26};
  made.points.assign(52, '\0');
  put(made.points, 20, std::uint16_t{255});
  put(made.points, 48, std::uint16_t{51});
  const auto eight = read_bytes<float>(made.file());
  CHECK(eight.colors(0, 0) == 1);
  CHECK(eight.colors(1, 1) == 51 / 255.0f);
  put(made.points, 50, std::uint16_t{256});
  const auto sixteen = read_bytes<float>(made.file());
  CHECK(sixteen.colors(0, 0) == 255 / 65535.0f);
  // Colours that this library wrote are what they are, however dark.
  const test::temporary_folder folder;
  auto dark = eight;
  dark.colors *= 0.0001f;
  write_las(dark, folder / "a.las");
  CHECK((read_las<float>(folder / "a.las").colors - dark.colors).cwiseAbs().maxCoeff() < 1e-5);
}

TEST_CASE("extra bytes are attributes of their names and types, and are written back") {
  const test::temporary_folder folder;
  las_bytes made{.minor = 4, .format = 6, .record_length = 30 + 1 + 2 + 4 + 8 + 4 + 6 + 2};
  made.add_record("LASF_Spec", 4, "",
                  test::extra_bytes("Pulse width", 1) + test::extra_bytes("height", 4, 24, 0.1, 5) +
                      test::extra_bytes("Amplitude", 9) + test::extra_bytes("range", 10) +
                      test::extra_bytes("intensity", 5) + test::extra_bytes("shape", 23));
  made.points.assign(made.record_length, '\0');
  made.points[30] = 200 - 256;
  put(made.points, 31, std::int16_t{-30});
  put(made.points, 33, 0.5f);
  put(made.points, 37, 1e-300);
  put(made.points, 45, 123456u);
  put(made.points, 49, std::uint16_t{1});
  put(made.points, 53, std::uint16_t{3});
  made.points[55] = 42;
  const auto bytes = made.file();
  const auto cloud = read_bytes<float>(bytes);
  CHECK(cloud.attribute_as<std::uint8_t>("Pulse_width")[0] == 200);
  CHECK(cloud.attribute_as<double>("height")[0] == doctest::Approx(2));
  CHECK(cloud.attribute_as<float>("Amplitude")[0] == 0.5f);
  CHECK(cloud.attribute_as<double>("range")[0] == 1e-300);
  CHECK(cloud.attribute_as<std::uint16_t>("intensity")[0] == 0);
  CHECK(cloud.attribute_as<std::uint32_t>("intensity_2")[0] == 123456);
  CHECK(cloud.attribute_as<std::uint16_t>("shape[2]")[0] == 3);
  CHECK(cloud.attribute_as<std::uint8_t>("extra_bytes[0]")[0] == 42);

  SUBCASE("as what they became") {
    write_las(cloud, folder / "a.las");
    CHECK(read_las<float>(folder / "a.las").attributes == cloud.attributes);
  }
  SUBCASE("as the file had them") {
    const auto info = las_header(std::as_bytes(std::span{bytes}));
    write_las(cloud, folder / "a.las", {.like = info});
    const auto again = las_header(folder / "a.las");
    const auto* record = again.find_record("LASF_Spec", 4);
    REQUIRE(record != nullptr);
    CHECK(std::memcmp(record->data.data(), info.records[0].data.data(), 5 * 192) != 0);
    CHECK(std::memcmp(record->data.data(), info.records[0].data.data(), 4 * 192) == 0);
    CHECK(again.record_length == info.record_length);
    CHECK(read_las<float>(folder / "a.las").attributes == cloud.attributes);
  }
}

TEST_CASE("a header tells everything, and its records are carried to another file as they are") {
  const test::temporary_folder folder;
  const std::string binary{"\x01\x00\xff%\x00 end", 9};
  auto made = file_of(7, 10);
  made.add_record("LASF_Projection", 2112, "wkt", "PROJCS[\"a map\"]");
  made.add_record("somebody", 99, "what only they know", binary);
  made.add_extended("LASF_Projection", 2111, "PARAM_MT[\"x\"]");
  made.add_extended("long", 1, std::string(100'000, 'x'));
  test::write_file(folder / "a.las", made.file());
  const auto info = las_header(folder / "a.las");
  CHECK(info.version_minor == 4);
  CHECK(info.point_format == 7);
  CHECK(info.points == 10);
  CHECK(info.file_source_id == 7);
  CHECK(info.global_encoding == 1);
  CHECK(info.system_identifier == "a sensor");
  CHECK(info.generating_software == "a test");
  CHECK(info.creation_day == 123);
  CHECK(info.creation_year == 2025);
  CHECK(info.upper == Eigen::Vector3d::Constant(1000));
  CHECK(info.records.size() == 4);
  CHECK(info.find_record("somebody", 99)->description == "what only they know");

  write_las(read_las<double>(folder / "a.las"), folder / "b.las", {.like = info});
  const auto copied = las_header(folder / "b.las");
  REQUIRE(copied.records.size() == 4);
  for (const auto& r : info.records) {
    const auto* found = copied.find_record(r.user_id, r.id);
    REQUIRE(found != nullptr);
    CHECK(*found == r);
  }
  CHECK(copied.global_encoding == 17);
  CHECK(copied.file_source_id == 7);
  CHECK(copied.project_id == info.project_id);
  CHECK(copied.generating_software == "cilantro");
}

TEST_CASE("coordinate system, scale and format go through steps, and through other formats") {
  const test::temporary_folder folder;
  const std::string keys{"\x01\x00\x01\x00\x00\x00\xff%\x00 end", 13};
  auto made = file_of(3, 2000);
  made.offset = 500'000;
  made.add_record("LASF_Projection", 34735, "keys", keys);
  made.add_record("LASF_Projection", 34737, "", "a map|");
  made.add_record("other", 1, "", "not carried");
  test::write_file(folder / "a.las", made.file());
  read_cloud<float>(folder / "a.las") | write_cloud(folder / "a.ply");
  read_cloud<float>(folder / "a.ply") | voxel_downsample(500) | write_cloud(folder / "b.las");
  const auto before = las_header(folder / "a.las"), after = las_header(folder / "b.las");
  CHECK(after.point_format == 3);
  CHECK(after.version_minor == 2);
  CHECK(after.scale == before.scale);
  CHECK(after.offset == before.offset);
  CHECK(after.global_encoding == before.global_encoding);
  CHECK(after.points < before.points);
  CHECK(*after.find_record("LASF_Projection", 34735) == before.records[0]);
  CHECK(*after.find_record("LASF_Projection", 34737) == before.records[1]);
  CHECK(after.find_record("other", 1) == nullptr);
}

TEST_CASE_TEMPLATE("a cloud of anything is written and read back", T, CLOUD_SPACES) {
  const test::temporary_folder folder;
  using S = typename T::scalar;
  for (const index_t count : {0, 1, 5000}) {
    point_cloud<S, T::static_dimension> cloud{.points = test::random_points<T>(count, 1, -8, 8)};
    cloud.normals = test::random_points<T>(count, 2);
    cloud.colors = Eigen::Matrix3Xf::Constant(3, count, 0.2f);
    std::vector<std::int64_t> ids;
    std::vector<float> weights;
    for (index_t i = 0; i < count; ++i) {
      ids.push_back(std::numeric_limits<std::int64_t>::min() + i);
      weights.push_back(float(i) / 3);
    }
    cloud.set_attribute("id", std::move(ids));
    cloud.set_attribute("weight", std::move(weights));
    cloud.comments = {"one line", "another"};
    cloud.origin.setConstant(100);
    write_las(cloud, folder / "a.las");
    const auto back = read_las<S, T::static_dimension>(folder / "a.las");
    CHECK(back.size() == count);
    CHECK(back.origin == cloud.origin);
    if (count > 0) CHECK((back.points - cloud.points).cwiseAbs().maxCoeff() < 1e-6);
    CHECK(back.normals == cloud.normals);
    CHECK(back.colors == cloud.colors);
    CHECK(*back.find_attribute("id") == *cloud.find_attribute("id"));
    CHECK(*back.find_attribute("weight") == *cloud.find_attribute("weight"));
    REQUIRE(back.comments.size() == 3);
    CHECK(back.comments[1] == "one line");
    CHECK(back.comments[2] == "another");
  }
}

TEST_CASE("the format and the scale of a file fit what it holds") {
  const test::temporary_folder folder;
  const auto written = [&](const auto& cloud, const las_write_options& options = {}) {
    write_las(cloud, folder / "a.las", options);
    return las_header(folder / "a.las");
  };
  point_cloud<double, 3> cloud{.points = Eigen::Matrix3Xd{{0, 1500}, {0, 10}, {0, 0}}};
  CHECK(written(cloud).point_format == 6);
  CHECK(written(cloud).scale.isApprox(Eigen::Vector3d(1e-6, 1e-8, 1e-12), 1e-12));
  CHECK(written(cloud).offset == Eigen::Vector3d(750, 5, 0));
  CHECK(written(cloud).upper == Eigen::Vector3d(1500, 10, 0));
  CHECK(written(cloud, {.format = 1}).version_minor == 2);
  cloud.colors = Eigen::Matrix3Xf::Zero(3, 2);
  CHECK(written(cloud).point_format == 7);
  cloud.set_attribute("near_infrared", std::vector<std::uint16_t>{1, 2});
  CHECK(written(cloud).point_format == 8);
  cloud.points(0, 1) = 1e9;
  CHECK(written(cloud).scale[0] == 1);
  cloud.set_attribute("return_number", std::vector<int>{1, 3});
  CHECK(written(cloud).points_by_return[0] == 1);
  CHECK(written(cloud).points_by_return[2] == 1);
}

TEST_CASE("intensities of fractions, and other real numbers, find their place") {
  const test::temporary_folder folder;
  point_cloud<float, 3> cloud{.points = Eigen::Matrix3Xf::Zero(3, 2)};
  cloud.set_attribute("intensity", std::vector<double>{0.5, 1});
  cloud.set_attribute("classification", std::vector<float>{2.2f, 6});
  write_las(cloud, folder / "a.las");
  const auto back = read_las<float>(folder / "a.las");
  CHECK(back.attribute_as<std::uint16_t>("intensity")[0] == 32768);
  CHECK(back.attribute_as<std::uint16_t>("intensity")[1] == 65535);
  CHECK(back.attribute_as<std::uint8_t>("classification")[0] == 2);
}

TEST_CASE("what LAS cannot hold is refused, and no file appears") {
  const test::temporary_folder folder;
  const auto refusal = [&](const auto& cloud, const las_write_options& options = {}) {
    try {
      write_las(cloud, folder / "a.las", options);
    } catch (const invalid_input& error) {
      return std::string{error.what()};
    }
    return std::string{"no error"};
  };
  point_cloud<double, 3> cloud{.points = Eigen::Matrix3Xd::Zero(3, 2)};
  auto changed = cloud;
  changed.points(1, 1) = test::nan<double>;
  CHECK(refusal(changed).find("not all points are finite") != std::string::npos);
  changed.points(1, 1) = test::infinity<double>;
  CHECK(refusal(changed).find("not all points are finite") != std::string::npos);
  changed.points(1, 1) = 1e8;
  CHECK(refusal(changed, {.scale = Eigen::Vector3d::Constant(0.01)})
            .find("cannot be counted in steps of 0.01") != std::string::npos);
  CHECK(refusal(cloud, {.scale = Eigen::Vector3d::Zero()}) ==
        "write_las: scale and offset must be finite, and the scale not 0");
  CHECK(refusal(cloud, {.format = 11}) == "write_las: the point format must be from 0 to 10");
  changed = cloud;
  changed.set_attribute("classification", std::vector<int>{5, 40});
  CHECK(refusal(changed, {.format = 3}) ==
        "write_las: \"classification\" has values from 5 to 40, which point format 3 has no place "
        "for");
  CHECK(refusal(changed) == "no error");
  changed.set_attribute("intensity", std::vector<float>{5, test::nan<float>});
  CHECK(refusal(changed).find("\"intensity\" has values from nan") != std::string::npos);
  changed = cloud;
  changed.set_attribute(std::string(33, 'a'), std::vector<int>{5, 40});
  CHECK(refusal(changed).find("longer than the 32 bytes") != std::string::npos);
  CHECK(refusal(cloud, {.format = 0,
                        .records = {{.user_id = "x", .data = std::vector<std::byte>(70'000)}}})
            .find("LAS before 1.4 holds 65,535") != std::string::npos);
  std::filesystem::remove(folder / "a.las");
  CHECK(folder.count() == 0);
}

TEST_CASE("reading and writing LAS can be watched and stopped") {
  const test::temporary_folder folder;
  write_las(point_cloud<float, 3>{.points = test::random_points<test::f3>(100'000)},
            folder / "a.las");
  std::stop_source source;
  double last = 0;
  const task_monitor watched{.progress = [&](double p) { last = p; }, .stop = source.get_token()};
  const auto cloud = read_las<float>(folder / "a.las", {.monitor = watched});
  CHECK(last == 1);
  last = 0;
  write_las(cloud, folder / "b.las", {.monitor = watched});
  CHECK(last == 1);
  source.request_stop();
  CHECK_THROWS_AS((void)read_las<float>(folder / "a.las", {.monitor = watched}), cancelled);
  CHECK_THROWS_AS(write_las(cloud, folder / "c.las", {.monitor = watched}), cancelled);
  CHECK(folder.count() == 2);
}

TEST_CASE_TEMPLATE("pieces of a LAS file joined are the whole, wherever reading begins", S, float,
                   double) {
  const test::temporary_folder folder;
  for (const int format : {0, 2, 7}) {
    auto made = file_of(format, 10'000, 2);
    made.offset = 300'000;
    test::write_file(folder / "a.las", made.file());
    const auto whole = read_las<S>(folder / "a.las");
    cloud_reader<S> reader{folder / "a.las"};
    CHECK(reader.size() == 10'000);
    for (const index_t size : {10'000, 3333}) {
      reader.seek(0);
      auto joined = reader.read(size);
      for (;;) {
        const auto piece = reader.read(size);
        if (piece.empty()) break;
        joined = append(joined, piece);
      }
      CHECK(joined.points == whole.points);
      CHECK(joined.colors == whole.colors);
      CHECK(joined.attributes == whole.attributes);
      CHECK(joined.origin == whole.origin);
    }
    reader.seek(9'990);
    const auto last = reader.read(100);
    CHECK(last.points == whole.points.rightCols(10));
    reader.set_origin(Eigen::Vector3d(1, 2, 3));
    reader.seek(0);
    CHECK(reader.read(1).origin == Eigen::Vector3d(1, 2, 3));
  }
}

TEST_CASE("endings .las and .laz choose the format, and .laz is not written") {
  const test::temporary_folder folder;
  const point_cloud<float, 3> cloud{.points = test::random_points<test::f3>(10)};
  write_cloud(cloud, folder / "a.LAS");
  CHECK(read_cloud<float>(folder / "a.LAS").size() == 10);
  CHECK_THROWS_AS(write_cloud(cloud, folder / "a.laz"), invalid_input);
}
