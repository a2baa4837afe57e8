// SPDX-License-Identifier: MIT
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstddef>
#include <filesystem>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

const std::string xyz = "property float x\nproperty float y\nproperty float z\n";

/// The message with which a file of this content is refused; empty if it is read.
std::string refusal(std::string_view content) {
  try {
    (void)read_ply<float>(std::as_bytes(std::span{content}), "f");
    return "";
  } catch (const io_error& error) {
    return error.what();
  }
}

/// The message with which reading `path` fails.
std::string failure(const std::filesystem::path& path) {
  try {
    (void)read_ply<float>(path);
    return "";
  } catch (const io_error& error) {
    CHECK(error.path() == path);
    return error.what();
  }
}

point_cloud<float, 3> some_cloud(index_t count = 1000) {
  point_cloud<float, 3> cloud{.points = test::random_points<test::f3>(count)};
  cloud.set_attribute("label", std::vector<int>(std::size_t(count), 7));
  return cloud;
}

bool ends_with(const std::string& text, const std::string& end) {
  if (text.ends_with(end)) return true;
  MESSAGE(text);
  return false;
}

}  // namespace

TEST_CASE("a header that is wrong is refused with its line") {
  const struct {
    std::string content, message;
  } cases[] = {
      {"", "f, byte 0: this is not a PLY file: it does not begin with \"ply\""},
      {"pl", "f, byte 0: this is not a PLY file: it does not begin with \"ply\""},
      {"PK\3\4", "f, byte 3: this is not a PLY file: it does not begin with \"ply\""},
      {"plymouth\n", "f, line 1: this is not a PLY file: its first line must be \"ply\""},
      {"ply\n", "f, line 1: the file ends within the header"},
      {"ply\nend_header\n", "f, line 2: the header names no format"},
      {"ply\nformat ascii 1.0\nend_header\n", "f, line 3: the file has no vertices"},
      {"ply\nformat utf8 1.0\n",
       "f, line 2: the format is none of ascii, binary_little_endian and binary_big_endian"},
      {"ply\nformat ascii 2.0\n", "f, line 2: the version of the format is not 1.0"},
      {"ply\nformat ascii 1.0\nformat ascii 1.0\n", "f, line 3: the header names a second format"},
      {"ply\nformat ascii 1.0\nelement vertex\n", "f, line 3: an element needs a name and a count"},
      {"ply\nformat ascii 1.0\nelement vertex -1\n",
       "f, line 3: an element needs a name and a count"},
      {"ply\nformat ascii 1.0\nelement vertex 1.5\n",
       "f, line 3: an element needs a name and a count"},
      {"ply\nformat ascii 1.0\nelement vertex 99999999999999999999999\n",
       "f, line 3: an element needs a name and a count"},
      {"ply\nformat ascii 1.0\nelement vertex 1\nelement vertex 1\n",
       "f, line 4: the element \"vertex\" comes twice"},
      {"ply\nformat ascii 1.0\nproperty float x\n",
       "f, line 3: a property comes before any element"},
      {"ply\nformat ascii 1.0\nelement vertex 1\nproperty half x\n",
       "f, line 4: \"half\" is no type of a PLY property"},
      {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float\n",
       "f, line 4: a property needs a type and a name"},
      {"ply\nformat ascii 1.0\nelement vertex 1\nproperty list float int a\n",
       "f, line 4: the length of a list must be an integer"},
      {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float x\n",
       "f, line 5: the property \"x\" comes twice"},
      {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n",
       "f, line 6: the vertices have no x, y and z"},
      {"ply\nformat ascii 1.0\nvertices: 3\n",
       "f, line 3: \"vertices:\" is no word of a PLY header"},
  };
  for (const auto& c : cases) CHECK(refusal(c.content) == c.message);
}

TEST_CASE("data that are wrong are refused with their line") {
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 2\n" + xyz + "property uchar label\nend_header\n";
  const struct {
    std::string data, message;
  } cases[] = {
      {"1 2 3 44\n1 2 3  \n", "f, line 10: the value of \"label\" is missing"},
      {"1 2 3 4\n1 2 3 4 5\n", "f, line 10: there are more values than the vertex has properties"},
      {"1 2 three 4\n1 2 3 4\n", "f, line 9: \"three\" is no value of \"z\""},
      {"1 2 3 256\n1 2 3 4\n", "f, line 9: \"256\" is no value of \"label\""},
      {"1 2 3 -1\n1 2 3 4\n", "f, line 9: \"-1\" is no value of \"label\""},
      {"1 2 3,5 4\n1 2 3 4\n", "f, line 9: \"3,5\" is no value of \"z\""},
      {"1 2 3 4 \n\n\n\n\n\n\n\n", "f, line 16: the file ends before all vertices were read"},
  };
  for (const auto& c : cases) CHECK(refusal(header + c.data) == c.message);
}

TEST_CASE("a count that the file cannot hold is refused before any memory is asked for") {
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"})
    for (const char* count : {"9223372036854775808", "18446744073709551615", "1000000000000"}) {
      const auto start = std::string{"ply\nformat "} + format + " 1.0\n";
      CHECK(refusal(start + "element vertex " + count + "\n" + xyz + "end_header\n1 2 3\n")
                .find("the header promises") != std::string::npos);
      CHECK(refusal(start + "element face " + count +
                    "\nproperty list int int i\nproperty uchar f\nelement vertex 1\n" + xyz +
                    "end_header\n1 2 3\n") != "");
      CHECK(refusal(start + "element vertex " + count + "\n" + xyz +
                    "property list int int i\nend_header\n1 2 3\n") != "");
    }
  // Elements without properties take no bytes, however many there are.
  CHECK(refusal("ply\nformat ascii 1.0\nelement ghost 18446744073709551615\nelement vertex 1\n" +
                xyz + "end_header\n1 2 3\n") == "");
}

TEST_CASE("a list longer than its file, or of negative length, is refused") {
  const auto start = "ply\nformat binary_little_endian 1.0\nelement vertex 1\n" + xyz;
  const std::string point(12, '\0');
  CHECK(refusal(start + "property list uint double l\nend_header\n" + point + "\xff\xff\xff\xff")
            .find("the file ends in the middle of the data") != std::string::npos);
  CHECK(refusal(start + "property list int double l\nend_header\n" + point + "\xff\xff\xff\xff")
            .find("a list has a negative length") != std::string::npos);
  CHECK(refusal("ply\nformat ascii 1.0\nelement vertex 1\n" + xyz +
                "property list uint int l\nend_header\n1 2 3 4000000000 1 2\n")
            .find("a list is shorter than its length says") != std::string::npos);
}

TEST_CASE("a header without an end is given up on, whatever the size of the file") {
  const std::string endless =
      "ply\nformat ascii 1.0\n" + std::string(1 << 20, 'c') + std::string(1 << 22, '\n');
  CHECK(refusal(endless) != "");
  std::string comments = "ply\nformat ascii 1.0\n";
  while (comments.size() < (2u << 20)) comments += "comment more of it\n";
  CHECK(refusal(comments).find("the header does not end within a mebibyte") != std::string::npos);
}

TEST_CASE(
    "a file cut off anywhere is refused, or read if only what follows the vertices is missing") {
  const test::temporary_folder folder;
  for (const ply_format format :
       {ply_format::ascii, ply_format::binary_little_endian, ply_format::binary_big_endian}) {
    write_ply(some_cloud(5), folder / "whole.ply", {.format = format});
    const auto whole = test::read_file(folder / "whole.ply");
    for (std::size_t size = 0; size < whole.size(); ++size) {
      const auto message = refusal(std::string_view{whole}.substr(0, size));
      // Text without its last characters may still be the number 7, or end without a line feed.
      if (format == ply_format::ascii && size + 1 == whole.size())
        CHECK(message == "");
      else
        CHECK(message != "");
    }
  }
}

TEST_CASE("every change of one byte is read or refused, and nothing else") {
  const test::temporary_folder folder;
  for (const ply_format format : {ply_format::ascii, ply_format::binary_big_endian}) {
    write_ply(some_cloud(2), folder / "whole.ply", {.format = format});
    auto content = test::read_file(folder / "whole.ply");
    for (std::size_t i = 0; i < content.size(); ++i)
      for (const char c : {'\0', '\n', ' ', '9', '-', '\xff'}) {
        const char before = content[i];
        content[i] = c;
        CHECK_NOTHROW((void)refusal(content));
        content[i] = before;
      }
  }
}

// The first cilantro threw std::length_error from within a vector.
TEST_CASE("a file that is missing is named") {
  CHECK(ends_with(failure("/nowhere/a.ply"),
                  "/nowhere/a.ply: cannot be read: No such file or directory"));
}

TEST_CASE("what is not a regular file is refused at once") {
  const test::temporary_folder folder;
  CHECK(ends_with(failure(folder.path()), "cannot be read: Is a directory"));
  REQUIRE(::mkfifo((folder / "pipe").c_str(), 0600) == 0);
  CHECK(ends_with(failure(folder / "pipe"), "cannot be read: it is not a regular file"));
  CHECK(ends_with(failure("/dev/zero"), "cannot be read: it is not a regular file"));
}

TEST_CASE("a file or folder without permission is refused, and nothing is left behind") {
  const test::temporary_folder folder;
  const auto locked = folder / "locked";
  std::filesystem::create_directory(locked);
  write_ply(some_cloud(), locked / "cloud.ply");
  const auto before = test::read_file(locked / "cloud.ply");
  ::chmod(folder.path().c_str(), 0755);
  ::chmod((locked / "cloud.ply").c_str(), 0000);
  ::chmod(locked.c_str(), 0555);
  // Root may do everything, so become nobody for a while.
  const bool was_root = ::geteuid() == 0;
  if (was_root) REQUIRE(::seteuid(65534) == 0);
  const auto read = failure(locked / "cloud.ply");
  const auto write = [&](const std::filesystem::path& path) {
    try {
      write_ply(some_cloud(), path);
      return std::string{};
    } catch (const io_error& error) {
      return std::string{error.what()};
    }
  };
  const auto over = write(locked / "cloud.ply"), beside = write(locked / "new.ply");
  if (was_root) REQUIRE(::seteuid(0) == 0);
  ::chmod(locked.c_str(), 0755);
  ::chmod((locked / "cloud.ply").c_str(), 0644);
  CHECK(ends_with(read, "cannot be read: Permission denied"));
  CHECK(ends_with(over, "cannot be written: Permission denied"));
  CHECK(ends_with(beside, "cannot be written: Permission denied"));
  CHECK(test::read_file(locked / "cloud.ply") == before);
  CHECK(std::distance(std::filesystem::directory_iterator{locked}, {}) == 1);
}

TEST_CASE("a folder that is not there, or stands where the file should be, is named") {
  const test::temporary_folder folder;
  CHECK_THROWS_WITH_AS(write_ply(some_cloud(), folder / "no/cloud.ply"),
                       doctest::Contains("cannot be written: No such file or directory"), io_error);
  CHECK_THROWS_WITH_AS(write_ply(some_cloud(), folder.path()),
                       doctest::Contains("cannot be written: Is a directory"), io_error);
  CHECK(folder.count() == 0);
}

TEST_CASE("a full device is an error") {
  CHECK_THROWS_WITH_AS(write_ply(some_cloud(), "/dev/full"),
                       doctest::Contains("cannot be written: No space left on device"), io_error);
}

TEST_CASE("on a full disk the file that was there stays, and nothing is left behind") {
  const test::temporary_folder folder;
  if (::mount("tmpfs", folder.path().c_str(), "tmpfs", 0, "size=64k") != 0) {
    MESSAGE("not tested: only root can make a small disk");
    return;
  }
  write_ply(some_cloud(1000), folder / "cloud.ply");
  const auto before = test::read_file(folder / "cloud.ply");
  for (const ply_format format : {ply_format::ascii, ply_format::binary_little_endian})
    CHECK_THROWS_WITH_AS(write_ply(some_cloud(100'000), folder / "cloud.ply", {.format = format}),
                         doctest::Contains("No space left on device"), io_error);
  CHECK(test::read_file(folder / "cloud.ply") == before);
  CHECK(folder.count() == 1);
  CHECK_THROWS_AS(write_png(image<rgb>(640, 480, {1, 2, 3}), folder.path() / "no" / "a.png"),
                  io_error);
  REQUIRE(::umount(folder.path().c_str()) == 0);
}

TEST_CASE("a file is replaced through a link, and keeps its permissions") {
  const test::temporary_folder folder;
  write_ply(some_cloud(3), folder / "real.ply");
  ::chmod((folder / "real.ply").c_str(), 0640);
  std::filesystem::create_symlink("real.ply", folder / "link.ply");
  write_ply(some_cloud(9), folder / "link.ply");
  CHECK(std::filesystem::is_symlink(folder / "link.ply"));
  CHECK(read_ply<float>(folder / "real.ply").size() == 9);
  CHECK(std::filesystem::status(folder / "real.ply").permissions() == std::filesystem::perms{0640});
}
