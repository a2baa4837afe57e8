// SPDX-License-Identifier: MIT
module;
#include <png.h>
#include <zlib.h>
#include <csetjmp>
#include <cstdio>

#include "io/common/file.hpp"
module cilantro.io;

namespace cilantro {
namespace {

/// What libpng's callbacks share with the code around them. libpng leaves them by `longjmp`, over
/// frames that hold nothing with a destructor; exceptions must not cross it either way.
struct png_io {
  detail::input_file* in = nullptr;
  detail::output_file* out = nullptr;
  char message[160] = {};
  int system_error = 0;
};

extern "C" void on_png_error(png_structp png, png_const_charp what) {
  auto& io = *static_cast<png_io*>(png_get_error_ptr(png));
  std::snprintf(io.message, sizeof io.message, "%s", what);
  std::longjmp(png_jmpbuf(png), 1);
}
extern "C" void on_png_warning(png_structp, png_const_charp) {}

void forward_io(png_structp png, int& error, auto transfer) {
  const char* what = nullptr;
  try {
    what = transfer();
  } catch (const std::system_error& e) {
    error = e.code().value();
    what = "input or output failed";
  }
  if (what) png_error(png, what);
}

extern "C" void on_png_read(png_structp png, png_bytep data, std::size_t count) {
  auto& io = *static_cast<png_io*>(png_get_io_ptr(png));
  forward_io(png, io.system_error, [&]() -> const char* {
    return io.in->read(reinterpret_cast<char*>(data), count) == count ? nullptr
                                                                      : "the file is truncated";
  });
}
extern "C" void on_png_write(png_structp png, png_bytep data, std::size_t count) {
  auto& io = *static_cast<png_io*>(png_get_io_ptr(png));
  forward_io(png, io.system_error, [&]() -> const char* {
    io.out->write(reinterpret_cast<const char*>(data), count);
    return nullptr;
  });
}
extern "C" void on_png_flush(png_structp) {}

[[noreturn]] void fail(const std::filesystem::path& path, const char* what, const png_io& io) {
  throw io_error{path, std::string{what} + ": " +
                           (io.system_error != 0 ? std::generic_category().message(io.system_error)
                                                 : std::string{io.message})};
}

struct png_reader {
  explicit png_reader(png_io& io)
      : png{png_create_read_struct(PNG_LIBPNG_VER_STRING, &io, on_png_error, on_png_warning)},
        info{png ? png_create_info_struct(png) : nullptr} {
    if (!info) throw std::bad_alloc{};
  }
  png_reader(const png_reader&) = delete;
  png_reader& operator=(const png_reader&) = delete;
  ~png_reader() { png_destroy_read_struct(&png, &info, nullptr); }
  png_structp png;
  png_infop info;
};

struct png_writer {
  explicit png_writer(png_io& io)
      : png{png_create_write_struct(PNG_LIBPNG_VER_STRING, &io, on_png_error, on_png_warning)},
        info{png ? png_create_info_struct(png) : nullptr} {
    if (!info) throw std::bad_alloc{};
  }
  png_writer(const png_writer&) = delete;
  png_writer& operator=(const png_writer&) = delete;
  ~png_writer() { png_destroy_write_struct(&png, &info); }
  png_structp png;
  png_infop info;
};

/// Nothing in here, nor in what it calls until libpng returns, may have a destructor.
bool read_png_header(const png_reader& reader, png_io& io) {
  if (setjmp(png_jmpbuf(reader.png))) return false;  // NOLINT: libpng's way to report errors
  png_set_read_fn(reader.png, &io, on_png_read);
  png_read_info(reader.png, reader.info);
  return true;
}

bool read_png_rows(const png_reader& reader, png_bytepp rows) {
  if (setjmp(png_jmpbuf(reader.png))) return false;  // NOLINT
  if constexpr (std::endian::native == std::endian::little) png_set_swap(reader.png);
  png_read_image(reader.png, rows);
  return true;
}

/// Rows of three bytes a pixel, whatever the file has: palettes and grey are spelled out, 16 bits
/// rounded to 8, and transparency is left out.
bool read_png_colors(const png_reader& reader, png_bytepp rows) {
  if (setjmp(png_jmpbuf(reader.png))) return false;  // NOLINT
  png_set_expand(reader.png);
  png_set_scale_16(reader.png);
  png_set_gray_to_rgb(reader.png);
  png_set_strip_alpha(reader.png);
  png_set_interlace_handling(reader.png);
  png_read_update_info(reader.png, reader.info);
  png_read_image(reader.png, rows);
  return true;
}

bool write_png_rows(const png_writer& writer, png_io& io, png_uint_32 width, png_uint_32 height,
                    int bits, int color_type, png_bytepp rows) {
  if (setjmp(png_jmpbuf(writer.png))) return false;  // NOLINT
  png_set_write_fn(writer.png, &io, on_png_write, on_png_flush);
  png_set_IHDR(writer.png, writer.info, width, height, bits, color_type, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  // What is left of colours once they are filtered is runs and noise: a search for more than runs
  // takes twice the time, for nothing in pictures of scans and a fifth in those of a few colours.
  if (color_type == PNG_COLOR_TYPE_RGB) {
    png_set_compression_level(writer.png, 1);
    png_set_compression_strategy(writer.png, Z_RLE);
  }
  png_write_info(writer.png, writer.info);
  if (bits == 16 && std::endian::native == std::endian::little) png_set_swap(writer.png);
  png_write_image(writer.png, rows);
  png_write_end(writer.png, writer.info);
  return true;
}

template <class T>
std::vector<png_bytep> rows_of(image<T>& pixels) {
  std::vector<png_bytep> rows;
  for (int y = 0; y < pixels.height(); ++y)
    rows.push_back(reinterpret_cast<png_bytep>(&pixels(0, y)));
  return rows;
}

template <class T>
image<T> read_image(const std::filesystem::path& path, bool (*read)(const png_reader&, png_bytepp),
                    auto check) {
  png_io io;
  try {
    detail::input_file file{path};
    io.in = &file;
    const png_reader reader{io};
    if (!read_png_header(reader, io)) fail(path, "cannot be read", io);
    check(reader);
    const auto width = png_get_image_width(reader.png, reader.info);
    const auto height = png_get_image_height(reader.png, reader.info);
    // Deflate shrinks by at most 1032 to 1: a larger image than that cannot be in the file.
    const std::uint64_t least = std::uint64_t{png_get_rowbytes(reader.png, reader.info)} * height;
    if (least > file.size() * 1032)
      throw io_error{path, "cannot be read: the file is too short for an image of its size"};
    image<T> pixels(static_cast<int>(width), static_cast<int>(height));
    auto rows = rows_of(pixels);
    if (!read(reader, rows.data())) fail(path, "cannot be read", io);
    return pixels;
  } catch (const std::system_error& error) {
    throw io_error{path, "cannot be read: " + error.code().message()};
  }
}

template <class T>
void write_image(const image<T>& pixels, const std::filesystem::path& path, int bits,
                 int color_type) {
  expects(!pixels.pixels().empty(), "write_png: the image must have pixels");
  auto copy = pixels;  // libpng's rows are not const.
  auto rows = rows_of(copy);
  png_io io;
  try {
    detail::output_file file{path};
    io.out = &file;
    const png_writer writer{io};
    if (!write_png_rows(writer, io, static_cast<png_uint_32>(pixels.width()),
                        static_cast<png_uint_32>(pixels.height()), bits, color_type, rows.data()))
      fail(path, "cannot be written", io);
    file.commit();
  } catch (const std::system_error& error) {
    throw io_error{path, "cannot be written: " + error.code().message()};
  }
}

}  // namespace

image<std::uint16_t> read_depth_png(const std::filesystem::path& path) {
  return read_image<std::uint16_t>(path, read_png_rows, [&](const png_reader& reader) {
    if (png_get_bit_depth(reader.png, reader.info) != 16 ||
        png_get_color_type(reader.png, reader.info) != PNG_COLOR_TYPE_GRAY)
      throw io_error{path, "is not a depth image: it does not have one channel of 16 bits"};
  });
}

image<rgb> detail::read_color_png(const std::filesystem::path& path) {
  return read_image<rgb>(path, read_png_colors, [](const png_reader&) {});
}

void write_png(const image<std::uint16_t>& depth, const std::filesystem::path& path) {
  write_image(depth, path, 16, PNG_COLOR_TYPE_GRAY);
}

void write_png(const image<rgb>& picture, const std::filesystem::path& path) {
  static_assert(sizeof(rgb) == 3);
  write_image(picture, path, 8, PNG_COLOR_TYPE_RGB);
}

}  // namespace cilantro
