// SPDX-License-Identifier: MIT
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

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
            .ends_with("is no depth image: it does not have one channel of 16 bits"));
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
  CHECK(read_color_png(folder / "picture.png") == picture);
  write_png(image<std::uint16_t>(2, 2, 0xffff), folder / "grey.png");
  CHECK(read_color_png(folder / "grey.png") == image<rgb>(2, 2, {255, 255, 255}));
  CHECK_THROWS_AS((void)read_color_png(folder / "no.png"), io_error);
  auto content = test::read_file(folder / "picture.png");
  test::write_file(folder / "part.png", std::string_view{content}.substr(0, content.size() / 2));
  CHECK_THROWS_AS((void)read_color_png(folder / "part.png"), io_error);
}
