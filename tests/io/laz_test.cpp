// SPDX-License-Identifier: MIT
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>

#include "laz_bytes.hpp"
#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;
using test::las_bytes;
using test::put;

namespace {

constexpr std::array<std::uint16_t, 9> lengths{20, 28, 26, 34, 0, 0, 30, 36, 38};

/// A flight that is not steady: jumps of places and times, several channels, values that stay and
/// values that change.
las_bytes flight(int format, index_t count, std::size_t extra = 0, unsigned channels = 1) {
  random_stream random{static_cast<std::uint64_t>(format)};
  const auto below = [&](unsigned n) { return static_cast<unsigned>(random.uniform(0, n)); };
  const auto any = [&] { return below(0xffffffffu); };
  las_bytes made{.minor = format >= 6 ? 4 : 2,
                 .format = format,
                 .record_length =
                     static_cast<std::uint16_t>(lengths[static_cast<std::size_t>(format)] + extra)};
  std::string record(made.record_length, '\0');
  const bool layered = format >= 6;
  std::array<std::uint32_t, 3> place{100, 4'000'000'000u, 7};
  double time = 1234.5;
  for (index_t i = 0; i < count; ++i) {
    for (std::size_t d = 0; d < 3; ++d) {
      place[d] = below(50) == 0 ? any() : place[d] + below(100) - 40;
      put(record, 4 * d, place[d]);
    }
    if (below(3) == 0) put(record, 12, static_cast<std::uint16_t>(below(4) ? below(200) : any()));
    if (below(2))
      record[14] = static_cast<char>(layered ? (below(5) + 1) * 16 + below(6)
                                             : (below(9) ? 9 + below(2) : any()));
    if (below(4) == 0)
      record[15] = static_cast<char>(layered ? (any() & 0xcf) | below(channels) << 4 : below(8));
    for (const std::size_t at : {16, 17})
      if (below(5) == 0) record[at] = static_cast<char>(below(9) ? below(6) : any());
    if (below(4) == 0) put(record, 18, static_cast<std::uint16_t>(below(3) ? below(4) : any()));
    if (layered && below(7) == 0) put(record, 20, static_cast<std::uint16_t>(any()));
    if (format == 1 || format == 3 || layered) {
      const unsigned kind = below(20);
      time += kind < 10 ? 1e-6 * (1 + below(3)) : kind == 11 ? 0.001 : kind == 12 ? -1e-5 : 0;
      if (kind == 13) time = below(5) * 1e5;
      if (kind == 14) time = random.uniform(-1e200, 1e200);
      put(record, layered ? 22 : 20, time);
    }
    const std::size_t color = format == 2 ? 20 : format == 3 ? 28 : format >= 7 ? 30 : 0;
    const auto grey = static_cast<std::uint16_t>(any());
    if (const unsigned kind = below(5); color > 0 && kind < 3)
      for (std::size_t c = 0; c < 3; ++c)
        put(record, color + 2 * c,
            kind == 0 ? grey : static_cast<std::uint16_t>(kind == 1 ? any() : below(256)));
    if (format == 8 && below(2)) put(record, 36, static_cast<std::uint16_t>(any()));
    for (std::size_t e = 0; e < extra; ++e)
      if (below(3) == 0) record[record.size() - 1 - e] = static_cast<char>(any());
    made.points += record;
  }
  return made;
}

template <class S>
point_cloud<S, 3> read_bytes(std::string_view bytes, const read_options& options = {}) {
  return read_las<S>(std::as_bytes(std::span{bytes}), "test.laz", options);
}

std::string message_of(std::string_view bytes) {
  try {
    (void)read_bytes<float>(bytes);
  } catch (const io_error& error) {
    return error.what();
  }
  return "no error";
}

template <class S>
void expect_same(const point_cloud<S, 3>& a, const point_cloud<S, 3>& b) {
  CHECK(a.points == b.points);
  CHECK(a.colors == b.colors);
  CHECK(a.attributes == b.attributes);
}

template <class T>
std::string with(std::string bytes, std::size_t at, T value) {
  put(bytes, at, value);
  return bytes;
}

/// Where the record of LASzip has its data, and where the points begin.
constexpr std::size_t scheme_at = 227 + 54, points_at = 227 + 54 + 34 + 6;

}  // namespace

TEST_CASE("LAZ files hold the points of the LAS files that they were made from") {
  for (const int format : {0, 1, 2, 3, 6, 7, 8})
    for (const std::size_t extra : {0, 3})
      for (const unsigned channels : {1, 4})
        for (const int version : {3, 4})
          for (const bool variable : {false, true}) {
            const bool layered = format >= 6;
            if (!layered && (channels > 1 || version > 3 || variable)) continue;
            CAPTURE(format);
            CAPTURE(extra);
            CAPTURE(channels);
            CAPTURE(version);
            const auto made = flight(format, 2500, extra, channels);
            const auto cloud =
                read_bytes<double>(test::laz::file(made, 700, layered ? version : 2, variable));
            expect_same(cloud, read_bytes<double>(made.file()));
          }
}

TEST_CASE("LAZ files without points, with one, and with points that are all alike") {
  for (const int format : {3, 7})
    for (const index_t count : {0, 1, 2}) {
      const auto made = flight(format, count);
      expect_same(read_bytes<float>(test::laz::file(made, 100)), read_bytes<float>(made.file()));
    }
  for (const int format : {1, 6}) {
    las_bytes made{.minor = format == 6 ? 4 : 2,
                   .format = format,
                   .record_length = lengths[static_cast<std::size_t>(format)]};
    made.points.assign(made.record_length * std::size_t{20'000}, '\1');
    const auto packed = test::laz::file(made, 50'000);
    CHECK(packed.size() < 2000);
    expect_same(read_bytes<float>(packed), read_bytes<float>(made.file()));
  }
}

TEST_CASE("pieces of a LAZ file joined are the whole, wherever reading begins") {
  const test::temporary_folder folder;
  for (const int format : {2, 7}) {
    test::write_file(folder / "a.laz", test::laz::file(flight(format, 3000), 700));
    const auto whole = read_cloud<float>(folder / "a.laz");
    cloud_reader<float> reader{folder / "a.laz"};
    CHECK(reader.size().value_or(0) == 3000);
    auto joined = reader.read(500);
    for (;;) {
      const auto piece = reader.read(500);
      if (piece.empty()) break;
      joined = append(joined, piece);
    }
    expect_same(joined, whole);
    CHECK(joined.origin == whole.origin);
    reader.seek(1399);
    CHECK(reader.read(2).points == whole.points.middleCols(1399, 2));
  }
}

TEST_CASE("the header of a LAZ file is that of points, and is not carried to a LAS file") {
  const test::temporary_folder folder;
  auto made = flight(6, 100);
  made.add_record("LASF_Projection", 2112, "", "a map");
  test::write_file(folder / "a.laz", test::laz::file(made, 50));
  const auto info = las_header(folder / "a.laz");
  CHECK(info.is_compressed);
  CHECK(info.point_format == 6);
  CHECK(info.points == 100);
  write_las(read_las<double>(folder / "a.laz"), folder / "b.las", {.like = info});
  const auto written = las_header(folder / "b.las");
  CHECK(!written.is_compressed);
  REQUIRE(written.records.size() == 1);
  CHECK(written.records[0] == info.records[0]);
  expect_same(read_las<double>(folder / "b.las"), read_las<double>(folder / "a.laz"));
}

TEST_CASE("reading LAZ can be stopped") {
  std::stop_source source;
  source.request_stop();
  const auto packed = test::laz::file(flight(3, 5000), 700);
  CHECK_THROWS_AS((void)read_bytes<float>(packed, {.monitor = {.stop = source.get_token()}}),
                  cancelled);
}

TEST_CASE("compression that is not decoded is refused in words") {
  const auto good = test::laz::file(flight(0, 10), 5);
  CHECK(message_of(good) == "no error");
  CHECK(message_of(with(good, scheme_at, std::uint16_t{1})) ==
        "test.laz, byte 321: the points are compressed in way 1 of LASzip; only 2 and 3, those in "
        "chunks, are read");
  CHECK(message_of(with(good, scheme_at + 2, std::uint16_t{1})) ==
        "test.laz, byte 321: the points are compressed by another coder than the arithmetic one");
  CHECK(
      message_of(with(good, scheme_at + 38, std::uint16_t{1})) ==
      "test.laz, byte 321: the points are compressed by version 1 of LASzip's parts, which is not "
      "read");
  CHECK(message_of(with(good, scheme_at + 34, std::uint16_t{10})) ==
        "test.laz, byte 321: the compressed parts of a point are not those of format 0");
  CHECK(message_of(with(good, scheme_at + 32, std::uint16_t{9})) ==
        "test.laz, byte 321: the record that says how points are compressed is cut");
  CHECK(message_of(with(good, 227 + 2, 'L')) ==
        "test.laz, byte 321: the points are compressed, and no record says how");
  las_bytes waves{.minor = 3, .format = 4, .record_length = 57};
  waves.add_record("laszip encoded", 22204, "", std::string(34, '\2'));
  auto bytes = waves.file();
  bytes[104] = static_cast<char>(0x84);
  CHECK(message_of(with(with(bytes, 235 + 54 + 2, std::uint16_t{0}), 235 + 54, std::uint32_t{2})
                       .replace(235 + 54 + 32, 2, 2, '\0')) ==
        "test.laz, byte 323: compressed points of format 4, those with waveforms, are not read");
}

TEST_CASE("a table of chunks that is missing, cut or wrong is an error") {
  const auto good = test::laz::file(flight(0, 10), 5);
  std::uint64_t table = 0;
  std::memcpy(&table, good.data() + points_at, sizeof table);
  CHECK(message_of(good.substr(0, static_cast<std::size_t>(table))) ==
        "test.laz, byte 329: the table of the chunks of compressed points is missing");
  CHECK(message_of(good.substr(0, static_cast<std::size_t>(table) + 8)) ==
        "test.laz, byte " + std::to_string(table) +
            ": the table of the chunks of compressed points is cut");
  CHECK(message_of(with(good, points_at, std::uint64_t{5})) ==
        "test.laz, byte 329: the table of the chunks of compressed points is missing");
  CHECK(message_of(with(good, static_cast<std::size_t>(table) + 4, std::uint32_t{1'000'000})) ==
        "test.laz, byte " + std::to_string(table) +
            ": the table promises 1000000 chunks of compressed points, for which the file is too "
            "short");
  CHECK(message_of(with(good, static_cast<std::size_t>(table) + 4, std::uint32_t{1})) ==
        "test.laz, byte " + std::to_string(table) +
            ": the header promises 10 points, and the chunks have 5");
  // A writer to a pipe notes at the end where the table is.
  std::string where(8, '\0');
  put(where, 0, table);
  CHECK(message_of(with(good, points_at, ~std::uint64_t{0}) + where) == "no error");
}

TEST_CASE("a LAZ file whose count of points lies is refused") {
  const auto good = test::laz::file(flight(0, 10), 5);
  const auto few = message_of(with(good, 107, std::uint32_t{4}));
  CHECK(few.find("the table of the chunks") == std::string::npos);
  CHECK(message_of(with(good, 107, std::uint32_t{12}))
            .find("the header promises 12 points, and the chunks have 10") != std::string::npos);
  // As many as two chunks of any size could have.
  auto huge = with(with(good, 107, std::uint32_t{2'000'000'000}), scheme_at + 12,
                   std::uint32_t{1'000'000'000});
  CHECK(message_of(huge).find("the header promises 2000000000 points in ") != std::string::npos);
}

TEST_CASE("a LAZ file cut anywhere, or with any bit flipped, is a cloud or an error") {
  for (const int format : {3, 7}) {
    const auto good = test::laz::file(flight(format, 30, 1, 2), 10);
    CHECK(message_of(good) == "no error");
    // Nothing depends on the last bytes of the table.
    for (std::size_t n = 0; n + 6 < good.size(); ++n)
      CHECK(message_of(good.substr(0, n)) != "no error");
    for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
      auto bad = good;
      bad[bit / 8] = static_cast<char>(static_cast<unsigned char>(bad[bit / 8]) ^ (1u << bit % 8));
      (void)message_of(bad);
    }
  }
}
