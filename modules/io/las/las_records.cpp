// SPDX-License-Identifier: MIT
module;
#include "io/common/byte_stream.hpp"
#include "io/common/random_bytes.hpp"
#include "io/las/las_record.hpp"
module cilantro.io;

import :las_file;

namespace cilantro {
namespace {

using detail::number;
using detail::parse_number;
using detail::word_reader;

// Such that no comment of anybody else is taken for them.
constexpr std::string_view file_keyword = "cilantro las version ",
                           record_keyword = "cilantro las record ";

/// The types 1 to 10 of a descriptor.
constexpr std::array extra_types{number::uint8,   number::int8,   number::uint16, number::int16,
                                 number::uint32,  number::int32,  number::uint64, number::int64,
                                 number::float32, number::float64};

las::extra_field parse_descriptor(const char* data) {
  las::extra_field field{.name = {data + 4, ::strnlen(data + 4, 32)},
                         .descriptor = {data, las::descriptor_size}};
  const auto type = static_cast<unsigned char>(data[2]);
  const auto options = static_cast<unsigned char>(data[3]);
  if (type == 0 || type > 30) {
    // What nobody describes further; the options are its length.
    field.count = std::max<std::size_t>(options, 1);
    return field;
  }
  // Types above 10 are those of two and three values.
  field.type = extra_types[(type - 1) % 10];
  field.count = std::size_t{1} + (type - 1) / 10;
  constexpr unsigned has_scale = 8, has_offset = 16;
  field.is_scaled = (options & (has_scale | has_offset)) != 0;
  for (std::size_t i = 0; i < 3; ++i) {
    if (options & has_scale) field.scale[i] = detail::load_little<double>(data + 112 + 8 * i);
    if (options & has_offset) field.offset[i] = detail::load_little<double>(data + 136 + 8 * i);
  }
  return field;
}

/// The lines of a text, up to a zero if there is one.
std::vector<std::string> lines_of(const las_record* record) {
  std::vector<std::string> lines;
  if (record == nullptr) return lines;
  std::string_view rest{reinterpret_cast<const char*>(record->data.data()), record->data.size()};
  rest = rest.substr(0, rest.find('\0'));
  while (!rest.empty()) {
    const auto end = rest.find('\n');
    auto line = rest.substr(0, end);
    if (line.ends_with('\r')) line.remove_suffix(1);
    lines.emplace_back(line);
    rest.remove_prefix(end == rest.npos ? rest.size() : end + 1);
  }
  return lines;
}

std::string escaped(const std::vector<std::byte>& data) {
  constexpr std::string_view digits = "0123456789ABCDEF";
  std::string text;
  for (const std::byte byte : data) {
    const auto c = std::to_integer<unsigned char>(byte);
    if (c > 0x20 && c < 0x7f && c != '%') {
      text += static_cast<char>(c);
    } else {
      text += '%';
      text += digits[c >> 4];
      text += digits[c & 15];
    }
  }
  return text;
}

std::optional<std::vector<std::byte>> unescaped(std::string_view text) {
  std::vector<std::byte> data;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned value = static_cast<unsigned char>(text[i]);
    if (text[i] == '%') {
      if (i + 2 >= text.size()) return std::nullopt;
      const char* end = text.data() + i + 3;
      if (std::from_chars(text.data() + i + 1, end, value, 16).ptr != end) return std::nullopt;
      i += 2;
    }
    data.push_back(static_cast<std::byte>(value));
  }
  return data;
}

void put(std::string& text, double value) {
  std::array<char, 64> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  text += ' ';
  text.append(digits.data(), end);
}

std::optional<las_info> parse_file_comment(std::string_view rest) {
  word_reader words{rest};
  las_info info;
  info.version_major = 1;
  bool good = words.next() == "1";
  const auto take = [&](std::string_view keyword, auto&... values) {
    good = good && words.next() == keyword;
    ((good = good && parse_number(words.next(), values)), ...);
  };
  good = good && parse_number(words.next(), info.version_minor);
  take("format", info.point_format);
  take("encoding", info.global_encoding);
  take("scale", info.scale[0], info.scale[1], info.scale[2]);
  take("offset", info.offset[0], info.offset[1], info.offset[2]);
  if (!good || !words.done() || info.version_minor < 0 || info.version_minor > 4 ||
      info.point_format < 0 || info.point_format >= las::formats || !info.scale.allFinite() ||
      !(info.scale.array() != 0).all() || !info.offset.allFinite())
    return std::nullopt;
  return info;
}

std::optional<las_record> parse_record_comment(std::string_view rest) {
  word_reader words{rest};
  las_record record;
  const auto user = unescaped(words.next());
  if (!user || user->size() > 16 || !parse_number(words.next(), record.id)) return std::nullopt;
  const auto description = unescaped(words.next()), data = unescaped(words.next());
  if (!description || description->empty() || description->size() > 33 || !data ||
      data->size() > 65'535 || !words.done())
    return std::nullopt;
  const auto text = [](const std::vector<std::byte>& bytes) {
    return std::string{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  };
  record.user_id = text(*user);
  record.description = text(*description).substr(1);
  record.data = *data;
  return record;
}

}  // namespace

bool is_coordinate_system(const las_record& record) {
  constexpr std::array<std::uint16_t, 5> ids{2111, 2112, 34735, 34736, 34737};
  return record.user_id == las_projection && std::ranges::find(ids, record.id) != ids.end();
}

std::string attribute_name(std::string_view name) {
  std::string good{name};
  for (char& c : good)
    if (static_cast<unsigned char>(c) <= ' ' || c == '\x7f') c = '_';
  return good.empty() ? "extra" : good;
}

std::vector<las::extra_field> extra_fields(const las_record* record, std::size_t room) {
  std::vector<las::extra_field> fields;
  for (std::size_t at = 0;
       record != nullptr && at + las::descriptor_size <= record->data.size() && room > 0;
       at += las::descriptor_size) {
    auto field = parse_descriptor(reinterpret_cast<const char*>(record->data.data()) + at);
    const std::size_t size = detail::size_of(field.type) * field.count;
    // A descriptor of more than there is describes another file.
    if (size > room) break;
    room -= size;
    fields.push_back(std::move(field));
  }
  if (room > 0) fields.push_back({.name = "extra_bytes", .count = room});
  return fields;
}

std::vector<std::string> las_comments(const las_info& info) {
  std::string file{file_keyword};
  file += "1 " + std::to_string(info.version_minor) + " format " +
          std::to_string(info.point_format) + " encoding " + std::to_string(info.global_encoding) +
          " scale";
  for (const double v : info.scale) put(file, v);
  file += " offset";
  for (const double v : info.offset) put(file, v);
  std::vector<std::string> comments{std::move(file)};
  for (const auto& r : info.records) {
    if (!is_coordinate_system(r) || r.data.empty() || r.data.size() > 65'535) continue;
    std::vector<std::byte> user, description{std::byte{':'}};
    for (const char c : r.user_id) user.push_back(static_cast<std::byte>(c));
    for (const char c : r.description) description.push_back(static_cast<std::byte>(c));
    comments.push_back(std::string{record_keyword} + escaped(user) + ' ' + std::to_string(r.id) +
                       ' ' + escaped(description) + ' ' + escaped(r.data));
  }
  for (auto& line : lines_of(info.find_record(las_spec, text_area_id)))
    comments.push_back(std::move(line));
  return comments;
}

las_hints take_las_hints(std::vector<std::string>& comments) {
  las_hints hints;
  std::erase_if(comments, [&](std::string_view comment) {
    if (comment.starts_with(file_keyword)) {
      const auto info = parse_file_comment(comment.substr(file_keyword.size()));
      // Clouds that were put together have the comments of each; the first counts.
      if (info && !hints.info) hints.info = info;
      return info.has_value();
    }
    if (!comment.starts_with(record_keyword)) return false;
    auto record = parse_record_comment(comment.substr(record_keyword.size()));
    if (!record) return false;
    const auto same = [&](const las_record& r) {
      return r.user_id == record->user_id && r.id == record->id;
    };
    if (std::ranges::none_of(hints.records, same)) hints.records.push_back(std::move(*record));
    return true;
  });
  return hints;
}

}  // namespace cilantro
