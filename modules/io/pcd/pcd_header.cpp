// SPDX-License-Identifier: MIT
#include "io/pcd/pcd_header.hpp"

#include <charconv>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace cilantro::pcd {
namespace {

using detail::byte_stream;
using detail::word_reader;

/// The header must end somewhere: a file of another kind is not read to its end in search of it.
constexpr std::uint64_t longest_header = std::uint64_t{1} << 20;
/// More values a point than any descriptor has.
constexpr std::uint64_t most_columns = std::uint64_t{1} << 16;

class header_reader {
 public:
  explicit header_reader(byte_stream& in) : in_{in} {}

  header read() {
    for (;;) {
      const auto line = in_.take_line();
      if (!line) in_.fail_at_line("the file ends before a line DATA: this is not a PCD file");
      if (in_.position() > longest_header)
        in_.fail_at_line("the header does not end within a mebibyte: this is not a PCD file");
      if (line->starts_with('#')) {
        take_comment(*line);
        continue;
      }
      word_reader words{*line};
      const auto keyword = words.next();
      if (keyword.empty()) continue;
      if (keyword == "DATA") {
        take_data(words);
        break;
      }
      take(keyword, words);
    }
    check();
    return std::move(header_);
  }

 private:
  void take_comment(std::string_view line) {
    if (line.starts_with("# .PCD")) return;
    line.remove_prefix(line.starts_with("# ") ? 2 : 1);
    header_.comments.emplace_back(line);
  }

  void take(std::string_view keyword, word_reader& words) {
    if (keyword == "VERSION") {
      const auto version = words.next();
      double number = 0;
      if (!detail::parse_number(version, number) || !(number > 0 && number < 1))
        in_.fail_at_line("the version of the format is none of 0.5, 0.6 and 0.7");
    } else if (keyword == "FIELDS" || keyword == "COLUMNS") {
      names_ = all(words);
    } else if (keyword == "SIZE") {
      sizes_ = all(words);
    } else if (keyword == "TYPE") {
      types_ = all(words);
    } else if (keyword == "COUNT") {
      counts_ = all(words);
    } else if (keyword == "WIDTH") {
      width_ = integer(words.next(), "WIDTH");
    } else if (keyword == "HEIGHT") {
      height_ = integer(words.next(), "HEIGHT");
    } else if (keyword == "POINTS") {
      points_ = integer(words.next(), "POINTS");
    } else if (keyword == "VIEWPOINT") {
      take_viewpoint(words);
    } else {
      in_.fail_at_line("\"" + std::string{keyword.substr(0, 40)} + "\" is no word of a PCD header");
    }
  }

  void take_viewpoint(word_reader& words) {
    constexpr double usual[] = {0, 0, 0, 1, 0, 0, 0};
    const std::string_view rest = words.rest();
    bool is_usual = true;
    for (const double expected : usual) {
      double value = 0;
      if (!detail::parse_number(words.next(), value))
        in_.fail_at_line("the viewpoint does not have seven numbers");
      is_usual = is_usual && value == expected;
    }
    if (!is_usual) header_.comments.push_back(std::string{viewpoint_keyword} + std::string{rest});
  }

  void take_data(word_reader& words) {
    const auto name = words.next();
    if (name == "ascii")
      header_.data = encoding::ascii;
    else if (name == "binary")
      header_.data = encoding::binary;
    else if (name == "binary_compressed")
      header_.data = encoding::binary_compressed;
    else
      in_.fail_at_line("the data are none of ascii, binary and binary_compressed");
  }

  void check() {
    if (names_.empty()) in_.fail_at_line("the header names no fields");
    if (sizes_.size() != names_.size() || types_.size() != names_.size() ||
        (!counts_.empty() && counts_.size() != names_.size()))
      in_.fail_at_line("there must be one SIZE, one TYPE and one COUNT for each of the FIELDS");
    std::set<std::string_view> seen;
    for (std::size_t i = 0; i < names_.size(); ++i) {
      if (names_[i] != "_" && !seen.insert(names_[i]).second)
        in_.fail_at_line("the field \"" + names_[i] + "\" comes twice");
      field next{names_[i], type_of(types_[i], sizes_[i])};
      const auto count = counts_.empty() ? 1 : integer(counts_[i], "COUNT");
      if (count > most_columns)
        in_.fail_at_line("the field \"" + names_[i] + "\" has too many values");
      // Some programs fill up records by fields without values.
      if (count == 0) continue;
      next.count = static_cast<std::uint32_t>(count);
      header_.fields.push_back(std::move(next));
    }
    if (header_.columns() > most_columns)
      in_.fail_at_line("there are more than 65536 values a point");
    if (!width_ && !points_) in_.fail_at_line("the header does not say how many points there are");
    header_.height = height_.value_or(1);
    header_.width = width_.value_or(header_.height == 1 ? *points_ : 0);
    if (header_.height != 0 && header_.width > ~std::uint64_t{0} / header_.height)
      in_.fail_at_line("WIDTH times HEIGHT is too large");
    header_.points = points_.value_or(header_.width * header_.height);
    if (header_.points != header_.width * header_.height)
      in_.fail_at_line("POINTS is not WIDTH times HEIGHT");
  }

  [[nodiscard]] number type_of(std::string_view type, std::string_view size) const {
    struct known {
      std::string_view type, size;
      number is;
    };
    constexpr known all[] = {{"I", "1", number::int8},    {"U", "1", number::uint8},
                             {"I", "2", number::int16},   {"U", "2", number::uint16},
                             {"I", "4", number::int32},   {"U", "4", number::uint32},
                             {"F", "4", number::float32}, {"F", "8", number::float64},
                             {"I", "8", number::int64},   {"U", "8", number::uint64}};
    for (const auto& k : all)
      if (k.type == type && k.size == size) return k.is;
    in_.fail_at_line("there is no type " + std::string{type.substr(0, 40)} + " of size " +
                     std::string{size.substr(0, 40)});
  }

  static std::vector<std::string> all(word_reader& words) {
    std::vector<std::string> list;
    for (auto word = words.next(); !word.empty(); word = words.next()) list.emplace_back(word);
    return list;
  }

  [[nodiscard]] std::uint64_t integer(std::string_view word, const char* what) const {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc{} || end != word.data() + word.size() || word.empty())
      in_.fail_at_line(std::string{what} + " is no number that counts");
    return value;
  }

  byte_stream& in_;
  header header_;
  std::vector<std::string> names_, sizes_, types_, counts_;
  std::optional<std::uint64_t> width_, height_, points_;
};

}  // namespace

header read_header(byte_stream& in) {
  return header_reader{in}.read();
}

}  // namespace cilantro::pcd
