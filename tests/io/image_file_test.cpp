// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "jpeg_file.hpp"
#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

image<std::uint16_t> some_depth() {
  image<std::uint16_t> depth(37, 21);
  random_stream random{1};
  for (auto& value : depth.pixels()) value = static_cast<std::uint16_t>(random());
  return depth;
}

/// Bytes that change slowly, as JPEG likes them.
std::vector<std::uint8_t> slope(int width, int height, int channels) {
  std::vector<std::uint8_t> bytes;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < channels; ++c)
        bytes.push_back(static_cast<std::uint8_t>(20 + 4 * x + (c + 1) * y));
  return bytes;
}

int largest_difference(const image<rgb>& picture, const std::vector<std::uint8_t>& bytes) {
  int largest = 0;
  for (std::size_t i = 0; i < picture.pixels().size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t channels = bytes.size() / picture.pixels().size();
      const int wanted = bytes[channels * i + (channels == 1 ? 0 : c)];
      largest = std::max(largest, std::abs(picture.pixels()[i][c] - wanted));
    }
  return largest;
}

std::string color_failure(const std::filesystem::path& path) {
  try {
    (void)read_color_image(path);
    return "";
  } catch (const io_error& error) {
    return error.what();
  }
}

std::string failure(const std::filesystem::path& path) {
  try {
    (void)read_depth_png(path);
    return "";
  } catch (const io_error& error) {
    return error.what();
  }
}

}  // namespace

TEST_CASE("a depth image is read as it was written") {
  const test::temporary_folder folder;
  const auto depth = some_depth();
  write_png(depth, folder / "depth.png");
  CHECK(read_depth_png(folder / "depth.png") == depth);
  CHECK(folder.count() == 1);
}

TEST_CASE("a picture is written as a PNG file, and is no depth image") {
  const test::temporary_folder folder;
  write_png(image<rgb>(5, 4, {255, 128, 0}), folder / "picture.png");
  CHECK(test::read_file(folder / "picture.png").starts_with("\x89PNG\r\n"));
  CHECK(failure(folder / "picture.png")
            .ends_with("is not a depth image: it does not have one channel of 16 bits"));
}

TEST_CASE("a depth image cut off anywhere is refused") {
  const test::temporary_folder folder;
  write_png(some_depth(), folder / "whole.png");
  const auto whole = test::read_file(folder / "whole.png");
  // The last 12 bytes are a chunk that says only that this is the end.
  for (std::size_t size = 0; size + 12 < whole.size(); size += 5) {
    test::write_file(folder / "part.png", std::string_view{whole}.substr(0, size));
    CHECK(failure(folder / "part.png") != "");
  }
}

TEST_CASE("a depth image with any byte changed is read or refused, and nothing else") {
  const test::temporary_folder folder;
  write_png(some_depth(), folder / "whole.png");
  auto content = test::read_file(folder / "whole.png");
  for (std::size_t i = 0; i < content.size(); i += 3) {
    content[i] = static_cast<char>(content[i] ^ 0x55);
    test::write_file(folder / "part.png", content);
    CHECK_NOTHROW((void)failure(folder / "part.png"));
    content[i] = static_cast<char>(content[i] ^ 0x55);
  }
}

TEST_CASE("a header that promises more pixels than the file can hold is refused") {
  const test::temporary_folder folder;
  write_png(some_depth(), folder / "whole.png");
  auto content = test::read_file(folder / "whole.png");
  // Width and height are big-endian at byte 16; the checksum of the header is then wrong as well.
  content[16] = content[20] = 0x00;
  content[17] = content[21] = 0x0f;
  test::write_file(folder / "huge.png", content);
  CHECK(failure(folder / "huge.png") != "");
}

TEST_CASE("what is not there or is no PNG file is refused with its name") {
  const test::temporary_folder folder;
  CHECK(failure(folder / "no.png").ends_with("cannot be read: No such file or directory"));
  CHECK(failure(folder.path()).ends_with("cannot be read: Is a directory"));
  test::write_file(folder / "text.png", "hello");
  CHECK(failure(folder / "text.png") != "");
  CHECK_THROWS_AS(write_png(image<rgb>{}, folder / "none.png"), invalid_input);
  CHECK_THROWS_AS(write_png(some_depth(), folder / "no/depth.png"), io_error);
  CHECK(folder.count() == 1);
}

TEST_CASE("pictures of every kind are read as red, green and blue") {
  const test::temporary_folder folder;
  image<rgb> picture(5, 3);
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 5; ++x)
      picture(x, y) = {std::uint8_t(50 * x), std::uint8_t(80 * y), std::uint8_t(x + y)};
  write_png(picture, folder / "picture.png");
  CHECK(read_color_image(folder / "picture.png") == picture);
  write_png(image<std::uint16_t>(2, 2, 0xffff), folder / "grey.png");
  CHECK(read_color_image(folder / "grey.png") == image<rgb>(2, 2, {255, 255, 255}));
  CHECK_THROWS_AS((void)read_color_image(folder / "no.png"), io_error);
  auto content = test::read_file(folder / "picture.png");
  test::write_file(folder / "part.png", std::string_view{content}.substr(0, content.size() / 2));
  CHECK_THROWS_AS((void)read_color_image(folder / "part.png"), io_error);
}

TEST_CASE("JPEG files are read as red, green and blue, whatever their ending") {
  const test::temporary_folder folder;
  const auto path = folder / "picture.png";
  for (const int channels : {1, 3})
    for (const bool progressive : {false, true}) {
      const auto bytes = slope(45, 19, channels);
      test::write_file(
          path, test::jpeg_file(bytes, 45, 19, {.channels = channels, .progressive = progressive}));
      const auto picture = read_color_image(path);
      REQUIRE(picture.width() == 45);
      REQUIRE(picture.height() == 19);
      CHECK(largest_difference(picture, bytes) <= 2);
    }
}

TEST_CASE("what is no picture, or one that cannot be shown in full, is refused") {
  const test::temporary_folder folder;
  const auto path = folder / "picture.jpg";
  CHECK(color_failure(path).ends_with("cannot be read: No such file or directory"));
  CHECK(color_failure(folder.path()).ends_with("cannot be read: Is a directory"));
  for (const std::string_view content : {"", "\xff", "GIF89a", "\xff\xd8"}) {
    test::write_file(path, content);
    CHECK(color_failure(path).ends_with("is neither a PNG nor a JPEG file"));
  }
  test::write_file(path, test::jpeg_file(slope(8, 8, 4), 8, 8, {.channels = 4}));
  CHECK(color_failure(path).find("cannot be read: ") != std::string::npos);
  test::write_file(path, test::jpeg_file(slope(8, 8, 3), 8, 8, {.arithmetic = true}));
  CHECK(color_failure(path).ends_with("its arithmetic coding is not supported"));
  for (const bool progressive : {false, true}) {
    const auto content = test::jpeg_file(slope(64, 64, 3), 64, 64, {.progressive = progressive});
    for (std::size_t size = 3; size < content.size(); size += 5) {
      test::write_file(path, std::string_view{content}.substr(0, size));
      CHECK(color_failure(path).ends_with("the file is truncated"));
    }
  }
}

TEST_CASE("a damaged JPEG file is a picture or an error, and takes no memory that it cannot fill") {
  const test::temporary_folder folder;
  const auto path = folder / "picture.jpg";
  random_stream random{7};
  for (const bool progressive : {false, true}) {
    const auto content = test::jpeg_file(slope(24, 24, 3), 24, 24, {.progressive = progressive});
    int refused = 0;
    for (int i = 0; i < 400; ++i) {
      auto damaged = content;
      for (int j = 0; j <= i % 4; ++j)
        damaged[3 + random() % (damaged.size() - 3)] = static_cast<char>(random());
      test::write_file(path, damaged);
      try {
        const auto picture = read_color_image(path);
        CHECK(picture.pixels().size() <= 513 * damaged.size());
      } catch (const io_error&) {
        ++refused;
      }
    }
    CHECK(refused > 100);
  }
}
