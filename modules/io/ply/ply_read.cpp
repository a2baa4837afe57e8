// SPDX-License-Identifier: MIT
module;
#include <cerrno>

#include "io/common/byte_stream.hpp"
#include "io/common/file.hpp"
#include "io/common/number.hpp"
#include "io/ply/ply_header.hpp"
module cilantro.io;

import :cloud_builder;
import :cloud_source;
import :file_scope;
import :line_blocks;

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
      : in_{in}, vertex_{vertex}, options_{options}, data_{data} {
    begin(0);
    if (!builder_->has_points())
      in_.fail_at_line(D == 2 ? "the vertices have no x and y" : "the vertices have no x, y and z");
    check_size();
  }

  [[nodiscard]] bool guesses() const { return builder_->has_floating_colors(); }

  /// The vertices `first` to `first + count` − 1, which are the next ones.
  point_cloud<S, D> read(std::uint64_t first, index_t count, std::vector<std::string> comments,
                         piece_agreement<D>* agreement = nullptr) {
    begin(first);
    if (agreement != nullptr) builder_->agree_with(*agreement);
    builder_->resize(count);
    if (data_ == encoding::ascii)
      read_lines(count);
    else if (vertex_.has_lists())
      read_with_lists(count);
    else
      read_records(count);
    return builder_->finish(std::move(comments));
  }

 private:
  void begin(std::uint64_t first) {
    builder_.emplace(fields_of(vertex_), options_.origin);
    first_ = double(first);
  }

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
    cilantro::watch(options_.monitor, first_ + double(done), double(vertex_.count));
  }

  /// Records of one size, some thousands at a time, property by property: each loop moves one
  /// column.
  void read_records(index_t count) {
    const std::size_t record = vertex_.least_size();
    const auto at_a_time =
        static_cast<index_t>(std::max<std::size_t>(1, (std::size_t{1} << 16) / record));
    for (index_t first = 0; first < count; first += at_a_time) {
      watch(first);
      const index_t n = std::min(at_a_time, count - first);
      const char* data = in_.take(record * static_cast<std::size_t>(n));
      for (std::size_t p = 0; p < vertex_.properties.size(); ++p) {
        builder_->store_column(p, first, n, data, record, swapped());
        data += detail::size_of(vertex_.properties[p].type);
      }
    }
    watch(count);
  }

  void read_with_lists(index_t count) {
    for (index_t i = 0; i < count; ++i) {
      if (i % 4096 == 0) watch(i);
      for (std::size_t p = 0; p < vertex_.properties.size(); ++p) {
        if (vertex_.properties[p].is_list)
          skip_list(in_, vertex_.properties[p], swapped());
        else
          detail::visit_number(vertex_.properties[p].type, [&]<class T>(T) {
            builder_->store(p, i, load_number<T>(in_.take(sizeof(T)), swapped()));
          });
      }
    }
    watch(static_cast<index_t>(vertex_.count));
  }

  void read_lines(index_t count) {
    line_blocks blocks{in_, options_.threads, 2 * vertex_.properties.size()};
    for (index_t done = 0; done < count;) {
      watch(done);
      const auto read = [&](auto& lines, index_t first, index_t n) {
        for (index_t i = 0; i < n; ++i) read_line(lines, done + first + i);
        return n;
      };
      const auto rows = blocks.read(
          count - done, [](std::string_view line) { return !is_blank(line); }, [](index_t) {},
          read);
      done += rows ? rows->count : read(in_, 0, std::min(count - done, blocks.few));
    }
    watch(static_cast<index_t>(vertex_.count));
  }

  template <class Lines>
  void read_line(Lines& in, index_t i) {
    word_reader words{next_line(in, "vertices")};
    for (std::size_t p = 0; p < vertex_.properties.size(); ++p) {
      if (vertex_.properties[p].is_list) {
        skip_words(in, words);
        continue;
      }
      detail::visit_number(vertex_.properties[p].type, [&]<class T>(T value) {
        const auto word = words.next();
        if (!parse_number(word, value)) fail_in_line(in, word, vertex_.properties[p]);
        builder_->store(p, i, value);
      });
    }
    if (!words.done()) in.fail_at_line("there are more values than the vertex has properties");
  }

  template <class Lines>
  static void skip_words(const Lines& in, word_reader& words) {
    std::uint32_t count = 0;
    if (!parse_number(words.next(), count))
      in.fail_at_line("a list does not begin with its length");
    for (; count > 0; --count)
      if (words.next().empty()) in.fail_at_line("a list is shorter than its length says");
  }

  template <class Lines>
  [[noreturn]] static void fail_in_line(const Lines& in, std::string_view word, const property& p) {
    if (word.empty()) in.fail_at_line("the value of \"" + p.name + "\" is missing");
    in.fail_at_line("\"" + std::string{word.substr(0, 40)} + "\" is no value of \"" + p.name +
                    "\"");
  }

  static bool is_blank(std::string_view line) { return word_reader{line}.done(); }

 public:
  /// The next line that is not blank.
  template <class Lines>
  static std::string_view next_line(Lines& in, std::string_view what) {
    for (;;) {
      const auto line = in.take_line();
      if (!line) in.fail_at_line("the file ends before all " + std::string{what} + " were read");
      if (!is_blank(*line)) return *line;
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
  const read_options& options_;
  encoding data_;
  std::optional<cloud_builder<S, D>> builder_;  ///< Of what is read at a time.
  double first_ = 0;
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

/// Passes over what comes before the vertices.
template <Scalar S, int D>
const element& find_vertices(byte_stream& in, const ply::header& header) {
  for (const auto& e : header.elements) {
    if (e.name == "vertex") return e;
    skip_element<vertex_reader<S, D>>(in, e, header.data);
  }
  in.fail_at_line("the file has no vertices");
}

template <Scalar S, int D>
point_cloud<S, D> read_stream(byte_stream& in, const read_options& options) {
  auto header = ply::read_header(in);
  const auto& vertices = find_vertices<S, D>(in, header);
  vertex_reader<S, D> reader{in, vertices, header.data, options};
  return reader.read(0, static_cast<index_t>(vertices.count), std::move(header.comments));
}

template <Scalar S, int D>
class ply_source : public cloud_source<S, D> {
 public:
  ply_source(const std::filesystem::path& path, const read_options& options)
      : file_{path},
        options_{options},
        header_{ply::read_header(file_.stream())},
        vertices_{find_vertices<S, D>(file_.stream(), header_)},
        reader_{file_.stream(), vertices_, header_.data, options_},
        begin_{file_.stream().position()} {}

  [[nodiscard]] std::optional<std::uint64_t> size() const override { return vertices_.count; }
  [[nodiscard]] bool guesses() const override { return reader_.guesses(); }
  point_cloud<S, D> read(index_t count) override {
    const auto n =
        static_cast<index_t>(std::min(static_cast<std::uint64_t>(count), vertices_.count - next_));
    if (has_records()) file_.stream().will_take(static_cast<std::uint64_t>(n) * record());
    auto piece = reader_.read(next_, n, header_.comments, &this->agreement());
    next_ += static_cast<std::uint64_t>(n);
    return piece;
  }
  bool seek(std::uint64_t first) override {
    if (!has_records()) return false;
    next_ = std::min(first, vertices_.count);
    file_.seek(begin_ + next_ * record());
    return true;
  }

 private:
  [[nodiscard]] bool has_records() const {
    return header_.data != encoding::ascii && !vertices_.has_lists();
  }
  [[nodiscard]] std::uint64_t record() const { return vertices_.least_size(); }

  open_file file_;
  read_options options_;
  ply::header header_;
  const element& vertices_;
  vertex_reader<S, D> reader_;
  std::uint64_t begin_, next_ = 0;
};

}  // namespace

template <Scalar S, int D>
source_pointer<S, D> open_ply(const std::filesystem::path& path, const read_options& options) {
  return std::make_unique<ply_source<S, D>>(path, options);
}

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
  template source_pointer<S, D> open_ply(const std::filesystem::path&, const read_options&);    \
  template point_cloud<S, D> read_ply<S, D>(const std::filesystem::path&, const read_options&); \
  template point_cloud<S, D> read_ply<S, D>(std::span<const std::byte>,                         \
                                            const std::filesystem::path&, const read_options&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
