// SPDX-License-Identifier: MIT
//
// Files as POSIX sees them: read in pieces, and written so that they appear complete or not at all.
// Failures are `std::system_error`s; what they mean to a user is said where the format is known.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

namespace cilantro::detail {

/// A regular file, open for reading.
class input_file {
 public:
  /// Throws `std::system_error` if it cannot be opened or is not a regular file.
  explicit input_file(const std::filesystem::path& path);
  input_file(const input_file&) = delete;
  input_file& operator=(const input_file&) = delete;
  ~input_file();

  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// Up to `count` bytes; fewer only at the end of the file.
  std::size_t read(char* out, std::size_t count);
  /// Up to `count` bytes from byte `at` on, from any thread, wherever `read` goes on.
  std::size_t read_at(std::uint64_t at, char* out, std::size_t count) const;
  /// Makes byte `place` the next one that is read.
  void seek(std::uint64_t place);

 private:
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

/// A file that is written beside its final name and takes that name when it is complete.
class output_file {
 public:
  /// Throws `std::system_error`. What exists and is not a regular file is written to directly.
  explicit output_file(const std::filesystem::path& path);
  output_file(const output_file&) = delete;
  output_file& operator=(const output_file&) = delete;
  /// Without a `commit` before, nothing remains of what was written.
  ~output_file();

  void write(const char* data, std::size_t count);
  void commit();
  /// Where the content is before that, for a program that writes it by name.
  [[nodiscard]] const std::filesystem::path& place() const {
    return temporary_.empty() ? final_ : temporary_;
  }

 private:
  std::filesystem::path final_, temporary_;
  int descriptor_ = -1;
};

}  // namespace cilantro::detail
