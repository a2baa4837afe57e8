// SPDX-License-Identifier: MIT
module;
#include "io/common/random_bytes.hpp"
#include "io/las/las_record.hpp"
module cilantro.io;

import :file_scope;
import :las_file;

namespace cilantro {
namespace {

using detail::failure;
using detail::load_little;
using detail::number;
using detail::random_bytes;

/// Text in a field of fixed length ends with it or at a zero.
std::string text_of(const char* data, std::size_t most) {
  std::string text{data, ::strnlen(data, most)};
  while (text.ends_with(' ')) text.pop_back();
  return text;
}

Eigen::Vector3d three(const char* data) {
  return {load_little<double>(data), load_little<double>(data + 8), load_little<double>(data + 16)};
}

/// The fields of the header that all versions have, and those of 1.3 and 1.4.
struct header_bytes {
  std::vector<char> bytes;

  template <class T>
  [[nodiscard]] T at(std::size_t place) const {
    return load_little<T>(bytes.data() + place);
  }
};

/// How many points: LAS 1.4 says it twice, if 32 bits can hold it.
std::uint64_t count_of(const header_bytes& header, bool is_latest) {
  const std::uint64_t old_count = header.at<std::uint32_t>(107);
  if (!is_latest) return old_count;
  const auto count = header.at<std::uint64_t>(247);
  if (old_count == 0 || old_count == count) return count;
  if (count == 0) return old_count;
  // Some writers put what is left of a count that 32 bits cannot hold.
  const bool is_cut =
      count > 0xffffffffu && (old_count == 0xffffffffu || old_count == (count & 0xffffffffu));
  if (!is_cut)
    throw failure{"the header has two counts of points that disagree, " +
                      std::to_string(old_count) + " and " + std::to_string(count),
                  false, 247};
  return count;
}

void take_counts_by_return(const header_bytes& header, bool is_latest, las_info& info) {
  for (std::size_t i = 0; i < (is_latest ? 15 : 5); ++i)
    info.points_by_return[i] =
        is_latest ? header.at<std::uint64_t>(255 + 8 * i) : header.at<std::uint32_t>(111 + 4 * i);
  for (std::size_t i = 0; is_latest && i < 5; ++i)
    if (info.points_by_return[i] == 0)
      info.points_by_return[i] = header.at<std::uint32_t>(111 + 4 * i);
}

/// `count` records from byte `at` on, and where they end.
std::uint64_t take_records(const random_bytes& file, std::uint64_t at, std::uint64_t count,
                           bool extended, std::vector<las_record>& records) {
  const std::uint64_t head = extended ? 60 : 54;
  if (count > file.size() / head)
    throw failure{"the header promises " + std::to_string(count) +
                      " records, for which the file is too short",
                  false, at};
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto bytes = file.read(at, head);
    at += head;
    const std::uint64_t length = extended ? load_little<std::uint64_t>(bytes.data() + 20)
                                          : load_little<std::uint16_t>(bytes.data() + 20);
    las_record record{.user_id = text_of(bytes.data() + 2, 16),
                      .id = load_little<std::uint16_t>(bytes.data() + 18),
                      .description = text_of(bytes.data() + (extended ? 28 : 22), 32),
                      .data = {},
                      .is_extended = extended};
    if (length > file.size() - at)
      throw failure{"the record " + record.user_id + ' ' + std::to_string(record.id) + " of " +
                        std::to_string(length) + " bytes reaches beyond the end of the file",
                    false, at};
    // Waveforms are as large as all points together, and are found by the points' own offsets.
    if (record.user_id != las_spec || record.id != wave_packets_id) {
      record.data.resize(static_cast<std::size_t>(length));
      file.read(at, reinterpret_cast<char*>(record.data.data()), record.data.size());
    }
    records.push_back(std::move(record));
    at += length;
  }
  return at;
}

void take_fields(const header_bytes& header, las_info& info) {
  const char* data = header.bytes.data();
  info.file_source_id = header.at<std::uint16_t>(4);
  // A reserved field of four bytes before LAS 1.2.
  if (info.version_minor >= 2) info.global_encoding = header.at<std::uint16_t>(6);
  std::memcpy(info.project_id.data(), data + 8, 16);
  info.system_identifier = text_of(data + 26, 32);
  info.generating_software = text_of(data + 58, 32);
  info.creation_day = header.at<std::uint16_t>(90);
  info.creation_year = header.at<std::uint16_t>(92);
  info.record_length = header.at<std::uint16_t>(105);
  info.scale = three(data + 131);
  info.offset = three(data + 155);
  for (int d = 0; d < 3; ++d) {
    info.upper[d] = header.at<double>(179 + 16 * static_cast<std::size_t>(d));
    info.lower[d] = header.at<double>(187 + 16 * static_cast<std::size_t>(d));
  }
}

void check(const las_info& info) {
  const auto refuse = [](const std::string& what, std::uint64_t at) {
    throw failure{what, false, at};
  };
  if (info.point_format >= las::formats)
    refuse("the point format " + std::to_string(info.point_format) + " is not one of 0 to 10", 104);
  if (info.record_length < las::record_size(info.point_format))
    refuse("a point of format " + std::to_string(info.point_format) + " takes " +
               std::to_string(las::record_size(info.point_format)) +
               " bytes, and the header gives it " + std::to_string(info.record_length),
           105);
  for (int d = 0; d < 3; ++d)
    if (!std::isfinite(info.scale[d]) || info.scale[d] == 0 || !std::isfinite(info.offset[d]))
      refuse("the scale or the offset of the coordinates is not a usable number", 131);
}

}  // namespace

las_layout read_las_layout(const random_bytes& file) {
  constexpr std::size_t shortest = 227, longest = 375;
  header_bytes header{file.read(0, std::min<std::uint64_t>(file.size(), longest))};
  if (header.bytes.size() < 4 || std::memcmp(header.bytes.data(), "LASF", 4) != 0)
    throw failure{"the file does not begin with LASF: this is not a LAS file", false, 0};
  if (header.bytes.size() < shortest) throw failure{"the header is cut", false, file.size()};

  las_layout layout;
  las_info& info = layout.info;
  info.version_major = header.at<std::uint8_t>(24);
  info.version_minor = header.at<std::uint8_t>(25);
  if (info.version_major != 1 || info.version_minor > 4)
    throw failure{"version " + std::to_string(info.version_major) + '.' +
                      std::to_string(info.version_minor) + " is not one of 1.0 to 1.4",
                  false, 24};
  const bool is_latest = info.version_minor == 4;
  const auto header_size = header.at<std::uint16_t>(94);
  const std::size_t least = is_latest ? longest : shortest;
  if (header_size < least || header.bytes.size() < least)
    throw failure{"the header has " + std::to_string(header_size) + " bytes, and must have " +
                      std::to_string(least),
                  false, 94};
  // The two highest bits mark compression.
  const auto format = header.at<std::uint8_t>(104);
  info.is_compressed = (format & 0xc0) != 0;
  info.point_format = format & 0x3f;
  take_fields(header, info);
  check(info);
  info.points = count_of(header, is_latest);
  take_counts_by_return(header, is_latest, info);
  layout.points_at = header.at<std::uint32_t>(96);
  if (layout.points_at < header_size || layout.points_at > file.size())
    throw failure{"the points begin at byte " + std::to_string(layout.points_at) +
                      ", within the header or beyond the end of the file",
                  false, 96};
  const auto end =
      take_records(file, header_size, header.at<std::uint32_t>(100), false, info.records);
  if (end > layout.points_at)
    throw failure{"the records reach into the points", false, layout.points_at};
  if (is_latest && header.at<std::uint32_t>(243) > 0)
    take_records(file, header.at<std::uint64_t>(235), header.at<std::uint32_t>(243), true,
                 info.records);
  layout.extras = extra_fields(info.find_record(las_spec, extra_bytes_id),
                               info.record_length - las::record_size(info.point_format));
  return layout;
}

las_info las_header(const std::filesystem::path& path) {
  return with_file(path, [&] {
    const random_bytes file{path};
    return read_las_layout(file).info;
  });
}

las_info las_header(std::span<const std::byte> bytes, const std::filesystem::path& name) {
  return with_place(name, [&] { return read_las_layout(random_bytes{bytes}).info; });
}

}  // namespace cilantro
