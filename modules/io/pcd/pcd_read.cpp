// SPDX-License-Identifier: MIT
module;
#include <lzf.h>
#include <cerrno>

#include "io/common/byte_stream.hpp"
#include "io/common/file.hpp"
#include "io/common/number.hpp"
#include "io/pcd/pcd_header.hpp"
module cilantro.io;

import :cloud_builder;
import :cloud_source;
import :file_scope;
import :line_blocks;

namespace cilantro {
namespace {

using detail::byte_stream;
using detail::word_reader;
using pcd::encoding;

constexpr bool swapped = std::endian::native == std::endian::big;

/// A column for each value of each field.
std::vector<file_field> fields_of(const pcd::header& header) {
  std::vector<file_field> fields;
  for (const auto& f : header.fields)
    for (std::uint32_t k = 0; k < f.count; ++k)
      fields.push_back(
          {f.count == 1 ? f.name : f.name + '[' + std::to_string(k) + ']', f.type, f.name == "_"});
  return fields;
}

template <Scalar S, int D>
class pcd_reader {
 public:
  pcd_reader(byte_stream& in, const read_options& options)
      : in_{in}, options_{options}, header_{pcd::read_header(in)}, fields_{fields_of(header_)} {
    begin(0);
    if (!builder_->has_points())
      in_.fail_at_line(D == 2 ? "the points have no x and y" : "the points have no x, y and z");
    if (header_.data == encoding::ascii) expect_bytes(2 * header_.columns());
    if (header_.data == encoding::binary) expect_bytes(header_.record());
  }

  [[nodiscard]] const pcd::header& header() const { return header_; }
  [[nodiscard]] bool guesses() const { return builder_->has_floating_colors(); }

  point_cloud<S, D> read() {
    if (header_.points > std::uint64_t{std::numeric_limits<std::int32_t>::max()})
      in_.fail_at_line("there are more than 2^31 - 1 points");
    auto cloud = read(0, static_cast<index_t>(header_.points));
    watch(options_.monitor, 1, 1);
    // A height of 1 is what a cloud without organisation is written with. Both fit, as their
    // product does.
    if (header_.height > 1 && header_.width > 0) {
      cloud.width = static_cast<int>(header_.width);
      cloud.height = static_cast<int>(header_.height);
    }
    return cloud;
  }

  /// The points `first` to `first + count` − 1, which are the next ones; all of them if they are
  /// compressed.
  point_cloud<S, D> read(std::uint64_t first, index_t count,
                         piece_agreement<D>* agreement = nullptr) {
    begin(first);
    if (agreement != nullptr) builder_->agree_with(*agreement);
    // How much is compressed is not known yet, and may be a lie.
    if (header_.data != encoding::binary_compressed) builder_->resize(count);
    switch (header_.data) {
      case encoding::ascii:
        read_lines(count);
        break;
      case encoding::binary:
        read_records(count);
        break;
      case encoding::binary_compressed:
        read_compressed(count);
    }
    return builder_->finish(header_.comments);
  }

 private:
  void begin(std::uint64_t first) {
    builder_.emplace(fields_, options_.origin, cloud_builder<S, D>::style::packed);
    first_ = double(first);
  }

  /// Refuses a count that the rest of the file cannot hold before any memory is asked for.
  void expect_bytes(std::uint64_t each) {
    if (each == 0 || header_.points > (in_.remaining() + 1) / each)
      in_.fail_at_byte("the header promises " + std::to_string(header_.points) +
                       " points of at least " + std::to_string(each) + " bytes, and only " +
                       std::to_string(in_.remaining()) + " bytes are left");
  }

  void read_lines(index_t count) {
    line_blocks blocks{in_, options_.threads, 2 * header_.columns()};
    for (index_t done = 0; done < count;) {
      watch(options_.monitor, first_ + double(done), double(header_.points));
      const auto read = [&](auto& lines, index_t first, index_t n) {
        for (index_t i = 0; i < n; ++i) read_line(lines, done + first + i);
        return n;
      };
      const auto rows = blocks.read(count - done, is_point, [](index_t) {}, read);
      done += rows ? rows->count : read(in_, 0, std::min(count - done, blocks.few));
    }
  }

  template <class Lines>
  void read_line(Lines& in, index_t i) {
    word_reader words{next_line(in), true};
    for (std::size_t f = 0; f < fields_.size(); ++f)
      detail::visit_number(fields_[f].type, [&]<class T>(T value) {
        const auto word = words.next();
        if (word.empty()) in.fail_at_line("the value of \"" + fields_[f].name + "\" is missing");
        if (!detail::parse_number(word, value))
          in.fail_at_line("\"" + std::string{word.substr(0, 40)} + "\" is no value of \"" +
                          fields_[f].name + "\"");
        builder_->store(f, i, value);
      });
    if (!words.done()) in.fail_at_line("there are more values than fields");
  }

  /// Whether a line is neither blank nor a comment.
  static bool is_point(std::string_view line) {
    return !line.starts_with('#') && !word_reader{line}.done();
  }

  template <class Lines>
  static std::string_view next_line(Lines& in) {
    for (;;) {
      const auto line = in.take_line();
      if (!line) in.fail_at_line("the file ends before all points were read");
      if (is_point(*line)) return *line;
    }
  }

  void read_records(index_t count) {
    const std::uint64_t record = header_.record();
    const auto at_a_time =
        static_cast<index_t>(std::max<std::uint64_t>(1, (std::uint64_t{1} << 16) / record));
    for (index_t first = 0; first < count; first += at_a_time) {
      watch(options_.monitor, first_ + double(first), double(header_.points));
      const index_t n = std::min(at_a_time, count - first);
      const char* data = in_.take(static_cast<std::size_t>(record) * static_cast<std::size_t>(n));
      for (std::size_t f = 0; f < fields_.size(); ++f) {
        builder_->store_column(f, first, n, data, static_cast<std::size_t>(record), swapped);
        data += detail::size_of(fields_[f].type);
      }
    }
  }

  /// Field after field, each of all points.
  void read_compressed(index_t count) {
    const auto compressed = detail::load_number<std::uint32_t>(in_.take(4), swapped);
    const auto size = detail::load_number<std::uint32_t>(in_.take(4), swapped);
    if (size != header_.points * header_.record())
      in_.fail_at_byte("the compressed data are " + std::to_string(size) +
                       " bytes, which are not those of all points");
    // Of LZF's tokens, the one of three bytes says most: 264 bytes.
    if (compressed > in_.remaining() || size > std::uint64_t{compressed} * 88)
      in_.fail_at_byte("the compressed data are not all there");
    std::vector<char> data(size);
    builder_->resize(count);
    if (size == 0) return;
    const char* in = in_.take(compressed);
    watch(options_.monitor, 0, 1);
    if (lzf_decompress(in, compressed, data.data(), size) != size)
      in_.fail_at_byte("the compressed data are damaged");
    const char* column = data.data();
    std::size_t f = 0;
    for (const auto& field : header_.fields) {
      watch(options_.monitor, double(f), double(fields_.size()));
      const std::size_t each = detail::size_of(field.type);
      for (std::uint32_t k = 0; k < field.count; ++k, ++f)
        builder_->store_column(f, 0, count, column + k * each, field.count * each, swapped);
      column += field.count * each * static_cast<std::size_t>(count);
    }
  }

  byte_stream& in_;
  const read_options& options_;
  pcd::header header_;
  std::vector<file_field> fields_;
  std::optional<cloud_builder<S, D>> builder_;  ///< Of what is read at a time.
  double first_ = 0;
};

template <Scalar S, int D>
class pcd_source : public cloud_source<S, D> {
 public:
  pcd_source(const std::filesystem::path& path, const read_options& options)
      : file_{path},
        options_{options},
        reader_{file_.stream(), options_},
        begin_{file_.stream().position()} {}

  [[nodiscard]] bool is_compressed() const {
    return reader_.header().data == encoding::binary_compressed;
  }
  [[nodiscard]] std::optional<std::uint64_t> size() const override {
    return reader_.header().points;
  }
  [[nodiscard]] bool guesses() const override { return reader_.guesses(); }
  point_cloud<S, D> read(index_t count) override {
    const auto n = static_cast<index_t>(
        std::min(static_cast<std::uint64_t>(count), reader_.header().points - next_));
    if (reader_.header().data == encoding::binary)
      file_.stream().will_take(static_cast<std::uint64_t>(n) * reader_.header().record());
    auto piece = reader_.read(next_, n, &this->agreement());
    next_ += static_cast<std::uint64_t>(n);
    return piece;
  }
  bool seek(std::uint64_t first) override {
    if (reader_.header().data == encoding::ascii) return false;
    next_ = std::min(first, reader_.header().points);
    file_.seek(begin_ + next_ * reader_.header().record());
    return true;
  }

 private:
  open_file file_;
  read_options options_;
  pcd_reader<S, D> reader_;
  std::uint64_t begin_, next_ = 0;
};

}  // namespace

template <Scalar S, int D>
  requires(D == 2 || D == 3)
point_cloud<S, D> read_pcd(const std::filesystem::path& path, const read_options& options) {
  return with_stream(path, [&](byte_stream& in) { return pcd_reader<S, D>{in, options}.read(); });
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
point_cloud<S, D> read_pcd(std::span<const std::byte> bytes, const std::filesystem::path& name,
                           const read_options& options) {
  return with_stream(bytes, name,
                     [&](byte_stream& in) { return pcd_reader<S, D>{in, options}.read(); });
}

template <Scalar S, int D>
source_pointer<S, D> open_pcd(const std::filesystem::path& path, const read_options& options) {
  auto source = std::make_unique<pcd_source<S, D>>(path, options);
  if (!source->is_compressed()) return source;
  source.reset();
  return std::make_unique<whole_source<S, D>>(read_pcd<S, D>(path, options));
}

#define CILANTRO_INSTANTIATE(S, D)                                                              \
  template source_pointer<S, D> open_pcd(const std::filesystem::path&, const read_options&);    \
  template point_cloud<S, D> read_pcd<S, D>(const std::filesystem::path&, const read_options&); \
  template point_cloud<S, D> read_pcd<S, D>(std::span<const std::byte>,                         \
                                            const std::filesystem::path&, const read_options&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
