// SPDX-License-Identifier: MIT
module;
#include <csetjmp>
#include <cstdio>

#include <jerror.h>
#include <jpeglib.h>

#include "io/common/file.hpp"
module cilantro.io;

namespace cilantro {
namespace {

/// No camera writes as many; a hostile file has each look at all pixels.
constexpr int most_scans = 500;

/// What libjpeg's callbacks share with the code around them, found by the structures of libjpeg
/// that it begins with. libjpeg is left by `longjmp`, over frames that hold nothing with a
/// destructor; exceptions must not cross it either way.
struct jpeg_io {
  jpeg_error_mgr errors{};
  jpeg_source_mgr source{};
  jpeg_progress_mgr progress{};
  detail::input_file* in = nullptr;
  std::array<JOCTET, 65536> buffer{};
  std::jmp_buf on_error{};
  char message[JMSG_LENGTH_MAX] = {};
  int system_error = 0;
};

jpeg_io& io_of(j_common_ptr jpeg) {
  return *static_cast<jpeg_io*>(jpeg->client_data);
}

extern "C" void on_jpeg_error(j_common_ptr jpeg) {
  auto& io = io_of(jpeg);
  jpeg->err->format_message(jpeg, io.message);
  std::longjmp(io.on_error, 1);
}

/// Whatever libjpeg would guess over is an error; what stands between segments says nothing.
extern "C" void on_jpeg_message(j_common_ptr jpeg, int level) {
  if (level < 0 && jpeg->err->msg_code != JWRN_EXTRANEOUS_DATA) on_jpeg_error(jpeg);
}

extern "C" void on_jpeg_progress(j_common_ptr jpeg) {
  if (reinterpret_cast<j_decompress_ptr>(jpeg)->input_scan_number > most_scans) {
    std::snprintf(io_of(jpeg).message, JMSG_LENGTH_MAX, "it has over %d scans", most_scans);
    std::longjmp(io_of(jpeg).on_error, 1);
  }
}

extern "C" void on_jpeg_source(j_decompress_ptr) {}

extern "C" boolean on_jpeg_read(j_decompress_ptr jpeg) {
  auto& io = io_of(reinterpret_cast<j_common_ptr>(jpeg));
  std::size_t count = 0;
  try {
    count = io.in->read(reinterpret_cast<char*>(io.buffer.data()), io.buffer.size());
  } catch (const std::system_error& error) {
    io.system_error = error.code().value();
  }
  if (count == 0) {
    std::snprintf(io.message, sizeof io.message, "the file is truncated");
    std::longjmp(io.on_error, 1);
  }
  io.source.next_input_byte = io.buffer.data();
  io.source.bytes_in_buffer = count;
  return TRUE;
}

extern "C" void on_jpeg_skip(j_decompress_ptr jpeg, long count) {
  auto& source = *jpeg->src;
  while (count > 0 && static_cast<std::size_t>(count) > source.bytes_in_buffer) {
    count -= static_cast<long>(source.bytes_in_buffer);
    on_jpeg_read(jpeg);
  }
  if (count <= 0) return;
  source.next_input_byte += count;
  source.bytes_in_buffer -= static_cast<std::size_t>(count);
}

class jpeg_reader {
 public:
  explicit jpeg_reader(detail::input_file& file) {
    io_.in = &file;
    jpeg_.err = jpeg_std_error(&io_.errors);
    jpeg_.client_data = &io_;
    io_.errors.error_exit = on_jpeg_error;
    io_.errors.emit_message = on_jpeg_message;
    io_.source.init_source = on_jpeg_source;
    io_.source.fill_input_buffer = on_jpeg_read;
    io_.source.skip_input_data = on_jpeg_skip;
    io_.source.resync_to_restart = jpeg_resync_to_restart;
    io_.source.term_source = on_jpeg_source;
    io_.progress.progress_monitor = on_jpeg_progress;
  }
  jpeg_reader(const jpeg_reader&) = delete;
  jpeg_reader& operator=(const jpeg_reader&) = delete;
  ~jpeg_reader() { jpeg_destroy_decompress(&jpeg_); }

  /// Nothing in here, nor in what it calls until libjpeg returns, may have a destructor.
  bool read_header() {
    if (setjmp(io_.on_error)) return false;  // NOLINT: libjpeg's way to report errors
    jpeg_create_decompress(&jpeg_);
    jpeg_.src = &io_.source;
    jpeg_.progress = &io_.progress;
    jpeg_read_header(&jpeg_, TRUE);
    jpeg_.out_color_space = JCS_RGB;
    return true;
  }
  bool read_rows(rgb* first) {
    if (setjmp(io_.on_error)) return false;  // NOLINT
    jpeg_start_decompress(&jpeg_);
    while (jpeg_.output_scanline < jpeg_.output_height) {
      auto* row = reinterpret_cast<JSAMPROW>(first + std::size_t{jpeg_.output_scanline} *
                                                         jpeg_.output_width);
      jpeg_read_scanlines(&jpeg_, &row, 1);
    }
    jpeg_finish_decompress(&jpeg_);
    return true;
  }

  [[nodiscard]] std::string problem() const {
    return io_.system_error != 0 ? std::generic_category().message(io_.system_error)
                                 : std::string{io_.message};
  }
  [[nodiscard]] int width() const { return static_cast<int>(jpeg_.image_width); }
  [[nodiscard]] int height() const { return static_cast<int>(jpeg_.image_height); }
  [[nodiscard]] bool is_arithmetic() const { return jpeg_.arith_code; }

 private:
  jpeg_io io_;
  jpeg_decompress_struct jpeg_{};
};

}  // namespace

image<rgb> detail::read_color_jpeg(const std::filesystem::path& path) try {
  detail::input_file file{path};
  const auto reader = std::make_unique<jpeg_reader>(file);
  const auto fail = [&](const std::string& why) { throw io_error{path, "cannot be read: " + why}; };
  if (!reader->read_header()) fail(reader->problem());
  if (reader->is_arithmetic()) fail("its arithmetic coding is not supported");
  // A block of 64 pixels takes one bit at least: a larger image than that cannot be in the file.
  if (std::uint64_t(reader->width()) * std::uint64_t(reader->height()) / 512 > file.size())
    fail("the file is too short for an image of its size");
  image<rgb> pixels(reader->width(), reader->height());
  if (!reader->read_rows(pixels.pixels().data())) fail(reader->problem());
  return pixels;
} catch (const std::system_error& error) {
  throw io_error{path, "cannot be read: " + error.code().message()};
}

image<rgb> read_color_image(const std::filesystem::path& path) {
  std::array<char, 3> head{};
  try {
    detail::input_file{path}.read(head.data(), head.size());
  } catch (const std::system_error& error) {
    throw io_error{path, "cannot be read: " + error.code().message()};
  }
  if (head == std::array{'\xff', '\xd8', '\xff'}) return detail::read_color_jpeg(path);
  if (head == std::array{'\x89', 'P', 'N'}) return detail::read_color_png(path);
  throw io_error{path, "is neither a PNG nor a JPEG file"};
}

}  // namespace cilantro
