// SPDX-License-Identifier: MIT
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>

#include "las_bytes.hpp"
#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;
using test::las_bytes;
using test::put;

namespace {

std::string message_of(std::string_view bytes) {
  try {
    (void)read_las<float>(std::as_bytes(std::span{bytes}), "test.las");
  } catch (const io_error& error) {
    return error.what();
  }
  return "no error";
}

las_bytes latest(std::uint64_t count) {
  las_bytes made{.minor = 4, .format = 6, .record_length = 30};
  made.points.assign(30 * static_cast<std::size_t>(count), '\1');
  return made;
}

template <class T>
std::string with(std::string bytes, std::size_t at, T value) {
  put(bytes, at, value);
  return bytes;
}

}  // namespace

TEST_CASE("what is wrong with a LAS file is said, with the byte") {
  las_bytes old{};
  old.points.assign(40, '\0');
  const auto good = old.file();
  CHECK(message_of(good) == "no error");
  CHECK(message_of("") ==
        "test.las, byte 0: the file does not begin with LASF: this is not a LAS file");
  CHECK(message_of("ply\nformat") ==
        "test.las, byte 0: the file does not begin with LASF: this is not a LAS file");
  CHECK(message_of(good.substr(0, 200)) == "test.las, byte 200: the header is cut");
  CHECK(message_of(with(good, 25, '\5')) ==
        "test.las, byte 24: version 1.5 is not one of 1.0 to 1.4");
  CHECK(message_of(with(good, 25, '\4')) ==
        "test.las, byte 94: the header has 227 bytes, and must have 375");
  CHECK(message_of(with(good, 94, std::uint16_t{100})) ==
        "test.las, byte 94: the header has 100 bytes, and must have 227");
  CHECK(
      message_of(with(good, 96, std::uint32_t{100'000})) ==
      "test.las, byte 96: the points begin at byte 100000, within the header or beyond the end of "
      "the file");
  CHECK(message_of(with(good, 104, '\13')) ==
        "test.las, byte 104: the point format 11 is not one of 0 to 10");
  CHECK(message_of(with(good, 105, std::uint16_t{19})) ==
        "test.las, byte 105: a point of format 0 takes 20 bytes, and the header gives it 19");
  CHECK(message_of(with(good, 131, 0.0)) ==
        "test.las, byte 131: the scale or the offset of the coordinates is not a usable number");
  CHECK(message_of(with(good, 155, test::nan<double>)) ==
        "test.las, byte 131: the scale or the offset of the coordinates is not a usable number");
}

TEST_CASE("a count of points that the file cannot hold is refused before memory is asked for") {
  las_bytes empty{};
  CHECK(message_of(empty.file()) == "no error");
  CHECK(
      message_of(with(empty.file(), 107, std::uint32_t{1065})) ==
      "test.las, byte 227: the header promises 1065 points of 20 bytes, and only 0 bytes are left");
  CHECK(
      message_of(with(latest(2).file(), 247, std::uint64_t{1} << 60)) ==
      "test.las, byte 375: the header promises 1152921504606846976 points of 30 bytes, and only 60 "
      "bytes are left");
}

TEST_CASE("the two counts of LAS 1.4 may not contradict each other") {
  const auto good = latest(2).file();
  CHECK(las_header(std::as_bytes(std::span{good})).points == 2);
  CHECK(message_of(with(good, 107, std::uint32_t{2})) == "no error");
  CHECK(message_of(with(good, 107, std::uint32_t{1})) ==
        "test.las, byte 247: the header has two counts of points that disagree, 1 and 2");
  // Writers of 1.4 that forgot the new count, and what is left of a large one in 32 bits.
  auto forgotten = with(with(good, 107, std::uint32_t{2}), 247, std::uint64_t{0});
  CHECK(las_header(std::as_bytes(std::span{forgotten})).points == 2);
  const std::uint64_t large = (std::uint64_t{1} << 32) + 5;
  auto cut = with(with(good, 107, std::uint32_t{5}), 247, large);
  CHECK(las_header(std::as_bytes(std::span{cut})).points == large);
  cut = with(with(good, 107, std::numeric_limits<std::uint32_t>::max()), 247, large);
  CHECK(las_header(std::as_bytes(std::span{cut})).points == large);
}

TEST_CASE("records that reach where they cannot are refused") {
  las_bytes made{};
  made.add_record("user", 1, "", "data");
  const auto good = made.file();
  CHECK(message_of(good) == "no error");
  CHECK(message_of(with(good, 247, std::uint16_t{60'000})) ==
        "test.las, byte 281: the record user 1 of 60000 bytes reaches beyond the end of the file");
  CHECK(message_of(with(good, 100, std::uint32_t{1'000'000})) ==
        "test.las, byte 227: the header promises 1000000 records, for which the file is too short");
  made.points.assign(200, '\0');
  CHECK(message_of(with(made.file(), 247, std::uint16_t{30})) ==
        "test.las, byte 285: the records reach into the points");
  auto late = latest(1);
  late.add_extended("late", 5, "data");
  CHECK(message_of(late.file()) == "no error");
  CHECK(message_of(with(late.file(), 235, std::uint64_t{1} << 63)) ==
        "test.las, byte 469: the file ends in the middle of the data");
  CHECK(message_of(with(late.file(), 405 + 20, std::uint64_t{1} << 63)) ==
        "test.las, byte 465: the record late 5 of 9223372036854775808 bytes reaches beyond the end "
        "of "
        "the file");
}

TEST_CASE("extra bytes whose description is cut, or of another file, are read as bytes") {
  las_bytes made{.record_length = 24};
  made.points.assign(24, '\7');
  made.add_record("LASF_Spec", 4, "", test::extra_bytes("long", 10) + "cut");
  const auto bytes = made.file();
  const auto cloud = read_las<float>(std::as_bytes(std::span{bytes}));
  CHECK(cloud.attribute_as<std::uint8_t>("extra_bytes[3]")[0] == 7);
}

TEST_CASE("a LAS file cut anywhere, or with any bit flipped, is a cloud or an error") {
  auto made = latest(3);
  made.record_length = 33;
  made.points.assign(99, '\1');
  made.add_record("LASF_Spec", 4, "", test::extra_bytes("extra", 3, 8, 0.5));
  made.add_record("LASF_Spec", 3, "", "cilantro origin 1 2 3\ncilantro size 3 1\n");
  made.add_extended("LASF_Projection", 2112, "PROJCS");
  const auto good = made.file();
  CHECK(message_of(good) == "no error");
  for (std::size_t n = 0; n < good.size(); ++n) CHECK(message_of(good.substr(0, n)) != "no error");
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    auto bad = good;
    bad[bit / 8] = static_cast<char>(static_cast<unsigned char>(bad[bit / 8]) ^ (1u << bit % 8));
    (void)message_of(bad);
  }
}
