// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "io/common/byte_stream.hpp"
#include "io/common/file.hpp"
#include "io/common/number.hpp"
#include "io/ply/ply_header.hpp"
module cilantro.io;

import :cloud_builder;
import :file_scope;

namespace cilantro {
namespace {

using detail::byte_stream;
using detail::load_number;
using detail::parse_number;
using detail::word_reader;
using ply::element;
using ply::encoding;
using ply::property;

template <Scalar S, int D>
class vertex_reader {
 public:
  vertex_reader(byte_stream& in, const element& vertex, encoding data, const read_options& options)
      : in_{in},
        vertex_{vertex},
        monitor_{options.monitor},
        data_{data},
        builder_{fields_of(vertex), options.origin} {
    if (!builder_.has_points())
      in_.fail_at_line(D == 2 ? "the vertices have no x and y" : "the vertices have no x, y and z");
    check_size();
  }

  point_cloud<S, D> read(std::vector<std::string> comments) {
    builder_.resize(static_cast<index_t>(vertex_.count));
    if (data_ == encoding::ascii)
      read_lines();
    else if (vertex_.has_lists())
      read_with_lists();
    else
      read_records();
    return builder_.finish(std::move(comments));
  }

 private:
  static std::vector<file_field> fields_of(const element& vertex) {
    std::vector<file_field> fields;
    for (const auto& p : vertex.properties) fields.push_back({p.name, p.type, p.is_list});
    return fields;
  }

  /// Every value takes at least a byte, or a digit and a separator: a count that the rest of the
  /// file cannot hold is refused before any memory is asked for.
  void check_size() const {
    const std::uint64_t least =
        data_ == encoding::ascii ? 2 * vertex_.properties.size() : vertex_.least_size();
    if (vertex_.count > (in_.remaining() + 1) / least)
      in_.fail_at_byte("the header promises " + std::to_string(vertex_.count) +
                       " vertices of at least " + std::to_string(least) + " bytes, and only " +
                       std::to_string(in_.remaining()) + " bytes are left");
  }

  [[nodiscard]] bool swapped() const {
    return (data_ == encoding::big_endian) != (std::endian::native == std::endian::big);
  }

  void watch(index_t done) {
    if (monitor_.stop.stop_requested()) throw cancelled{};
    if (monitor_.progress)
      monitor_.progress(double(done) / double(std::max<std::uint64_t>(1, vertex_.count)));
  }

  /// Records of one size, some thousands at a time, property by property: each loop moves one
  /// column.
  void read_records() {
    const std::size_t record = vertex_.least_size();
    const auto count = static_cast<index_t>(vertex_.count);
    const auto at_a_time =
        static_cast<index_t>(std::max<std::size_t>(1, (std::size_t{1} << 16) / record));
    for (index_t first = 0; first < count; first += at_a_time) {
      watch(first);
      const index_t n = std::min(at_a_time, count - first);
      const char* data = in_.take(record * static_cast<std::size_t>(n));
      for (std::size_t p = 0; p < vertex_.properties.size(); ++p) {
        builder_.store_column(p, first, n, data, record, swapped());
        data += detail::size_of(vertex_.properties[p].type);
      }
    }
    watch(count);
  }

  void read_with_lists() {
    for (index_t i = 0; i < static_cast<index_t>(vertex_.count); ++i) {
      if (i % 4096 == 0) watch(i);
      for (std::size_t p = 0; p < vertex_.properties.size(); ++p) {
        if (vertex_.properties[p].is_list)
          skip_list(in_, vertex_.properties[p], swapped());
        else
          detail::visit_number(vertex_.properties[p].type, [&]<class T>(T) {
            builder_.store(p, i, load_number<T>(in_.take(sizeof(T)), swapped()));
          });
      }
    }
    watch(static_cast<index_t>(vertex_.count));
  }

  void read_lines() {
    for (index_t i = 0; i < static_cast<index_t>(vertex_.count); ++i) {
      if (i % 4096 == 0) watch(i);
      word_reader words{next_line(in_, "vertices")};
      for (std::size_t p = 0; p < vertex_.properties.size(); ++p) {
        if (vertex_.properties[p].is_list) {
          skip_words(words);
          continue;
        }
        detail::visit_number(vertex_.properties[p].type, [&]<class T>(T value) {
          const auto word = words.next();
          if (!parse_number(word, value)) fail_in_line(word, vertex_.properties[p]);
          builder_.store(p, i, value);
        });
      }
      if (!words.done()) in_.fail_at_line("there are more values than the vertex has properties");
    }
    watch(static_cast<index_t>(vertex_.count));
  }

  void skip_words(word_reader& words) {
    std::uint32_t count = 0;
    if (!parse_number(words.next(), count))
      in_.fail_at_line("a list does not begin with its length");
    for (; count > 0; --count)
      if (words.next().empty()) in_.fail_at_line("a list is shorter than its length says");
  }

  [[noreturn]] void fail_in_line(std::string_view word, const property& p) const {
    if (word.empty()) in_.fail_at_line("the value of \"" + p.name + "\" is missing");
    in_.fail_at_line("\"" + std::string{word.substr(0, 40)} + "\" is no value of \"" + p.name +
                     "\"");
  }

 public:
  /// The next line that is not blank.
  static std::string_view next_line(byte_stream& in, const std::string& what) {
    for (;;) {
      const auto line = in.take_line();
      if (!line) in.fail_at_line("the file ends before all " + what + " were read");
      if (!word_reader{*line}.done()) return *line;
    }
  }

  static void skip_list(byte_stream& in, const property& list, bool swap) {
    const auto length = detail::visit_number(list.count_type, [&]<class T>(T) -> std::int64_t {
      return static_cast<std::int64_t>(load_number<T>(in.take(sizeof(T)), swap));
    });
    if (length < 0) in.fail_at_byte("a list has a negative length");
    in.skip(static_cast<std::uint64_t>(length) * detail::size_of(list.type));
  }

 private:
  byte_stream& in_;
  const element& vertex_;
  const task_monitor& monitor_;
  encoding data_;
  cloud_builder<S, D> builder_;
};

/// Passes over an element that comes before the vertices.
template <class Reader>
void skip_element(byte_stream& in, const element& e, encoding data) {
  if (e.properties.empty()) return;
  if (data == encoding::ascii) {
    for (std::uint64_t i = 0; i < e.count; ++i) Reader::next_line(in, e.name + " elements");
    return;
  }
  if (e.count > in.remaining() / e.least_size())
    in.fail_at_byte("the header promises more \"" + e.name + "\" than the file has bytes for");
  if (!e.has_lists()) return in.skip(e.count * e.least_size());
  const bool swap = (data == encoding::big_endian) != (std::endian::native == std::endian::big);
  for (std::uint64_t i = 0; i < e.count; ++i)
    for (const auto& p : e.properties)
      p.is_list ? Reader::skip_list(in, p, swap) : in.skip(detail::size_of(p.type));
}

template <Scalar S, int D>
point_cloud<S, D> read_stream(byte_stream& in, const read_options& options) {
  auto header = ply::read_header(in);
  for (const auto& e : header.elements) {
    if (e.name == "vertex")
      return vertex_reader<S, D>{in, e, header.data, options}.read(std::move(header.comments));
    skip_element<vertex_reader<S, D>>(in, e, header.data);
  }
  in.fail_at_line("the file has no vertices");
}

}  // namespace

template <Scalar S, int D>
  requires(D == 2 || D == 3)
point_cloud<S, D> read_ply(const std::filesystem::path& path, const read_options& options) {
  return with_stream(path, [&](byte_stream& in) { return read_stream<S, D>(in, options); });
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
point_cloud<S, D> read_ply(std::span<const std::byte> bytes, const std::filesystem::path& name,
                           const read_options& options) {
  return with_stream(bytes, name, [&](byte_stream& in) { return read_stream<S, D>(in, options); });
}

#define CILANTRO_INSTANTIATE(S, D)                                                              \
  template point_cloud<S, D> read_ply<S, D>(const std::filesystem::path&, const read_options&); \
  template point_cloud<S, D> read_ply<S, D>(std::span<const std::byte>,                         \
                                            const std::filesystem::path&, const read_options&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
