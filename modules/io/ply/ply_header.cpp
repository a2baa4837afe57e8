// SPDX-License-Identifier: MIT
#include "io/ply/ply_header.hpp"

#include <charconv>
#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "io/common/byte_stream.hpp"

namespace cilantro::ply {
namespace {

using detail::byte_stream;
using detail::word_reader;

/// The header must end somewhere: a file of another kind is not read to its end in search of it.
constexpr std::uint64_t longest_header = std::uint64_t{1} << 20;

class header_reader {
 public:
  explicit header_reader(byte_stream& in) : in_{in} {}

  header read() {
    in_.skip_byte_order_mark();
    // Looked at before lines are: a file of another kind may have none.
    if (in_.size() < 4 || std::string_view{in_.take(3), 3} != "ply")
      in_.fail_at_byte("this is not a PLY file: it does not begin with \"ply\"");
    if (!word_reader{line()}.done())
      in_.fail_at_line("this is not a PLY file: its first line must be \"ply\"");
    for (;;) {
      word_reader words{line()};
      const auto keyword = words.next();
      if (keyword == "end_header") break;
      if (keyword == "comment")
        header_.comments.emplace_back(words.rest());
      else if (keyword == "obj_info")
        header_.comments.push_back("obj_info " + std::string{words.rest()});
      else if (keyword == "format")
        read_format(words);
      else if (keyword == "element")
        read_element(words);
      else if (keyword == "property")
        read_property(words);
      else if (!keyword.empty())
        in_.fail_at_line("\"" + std::string{keyword.substr(0, 40)} +
                         "\" is no word of a PLY header");
    }
    if (!has_format_) in_.fail_at_line("the header names no format");
    return std::move(header_);
  }

 private:
  std::string_view line() {
    const auto next = in_.take_line();
    if (!next) in_.fail_at_line("the file ends within the header");
    if (in_.position() > longest_header)
      in_.fail_at_line("the header does not end within a mebibyte");
    return *next;
  }

  void read_format(word_reader& words) {
    const auto name = words.next();
    const auto version = words.next();
    if (has_format_) in_.fail_at_line("the header names a second format");
    if (name == "ascii")
      header_.data = encoding::ascii;
    else if (name == "binary_little_endian")
      header_.data = encoding::little_endian;
    else if (name == "binary_big_endian")
      header_.data = encoding::big_endian;
    else
      in_.fail_at_line("the format is none of ascii, binary_little_endian and binary_big_endian");
    if (version != "1.0") in_.fail_at_line("the version of the format is not 1.0");
    has_format_ = true;
  }

  void read_element(word_reader& words) {
    element next;
    next.name = words.next();
    const auto count = words.next();
    const auto [end, error] =
        std::from_chars(count.data(), count.data() + count.size(), next.count);
    if (next.name.empty() || error != std::errc{} || end != count.data() + count.size() ||
        !words.done())
      in_.fail_at_line("an element needs a name and a count");
    if (!elements_.insert(next.name).second)
      in_.fail_at_line("the element \"" + next.name + "\" comes twice");
    properties_.clear();
    header_.elements.push_back(std::move(next));
  }

  void read_property(word_reader& words) {
    if (header_.elements.empty()) in_.fail_at_line("a property comes before any element");
    property next;
    auto type = words.next();
    next.is_list = type == "list";
    if (next.is_list) {
      next.count_type = type_named(words.next());
      if (next.count_type == number::float32 || next.count_type == number::float64)
        in_.fail_at_line("the length of a list must be an integer");
      type = words.next();
    }
    next.type = type_named(type);
    next.name = words.next();
    if (next.name.empty() || !words.done()) in_.fail_at_line("a property needs a type and a name");
    if (!properties_.insert(next.name).second)
      in_.fail_at_line("the property \"" + next.name + "\" comes twice");
    header_.elements.back().properties.push_back(std::move(next));
  }

  [[nodiscard]] number type_named(std::string_view name) const {
    for (const auto& [known, type] : number_names)
      if (known == name) return type;
    in_.fail_at_line("\"" + std::string{name.substr(0, 40)} + "\" is no type of a PLY property");
  }

  byte_stream& in_;
  header header_;
  /// The names so far: of elements, and of the properties of the last of them.
  std::set<std::string> elements_, properties_;
  bool has_format_ = false;
};

}  // namespace

header read_header(byte_stream& in) {
  return header_reader{in}.read();
}

}  // namespace cilantro::ply
