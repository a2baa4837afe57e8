// SPDX-License-Identifier: MIT
//
// A file or memory that is read anywhere, by several threads at once. A plain header, which needs
// nothing of any module.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "io/common/byte_stream.hpp"
#include "io/common/file.hpp"
#include "io/common/number.hpp"

namespace cilantro::detail {

class random_bytes {
 public:
  /// Throws as `input_file` does.
  explicit random_bytes(const std::filesystem::path& path)
      : file_{std::make_unique<input_file>(path)} {}
  /// Memory that must outlive this.
  explicit random_bytes(std::span<const std::byte> bytes) : bytes_{bytes} {}

  [[nodiscard]] std::uint64_t size() const { return file_ ? file_->size() : bytes_.size(); }

  /// The `count` bytes from byte `at` on. Throws `failure` if the file ends before them.
  void read(std::uint64_t at, char* out, std::size_t count) const {
    if (at > size() || count > size() - at)
      throw failure{"the file ends in the middle of the data", false, size()};
    if (count == 0) return;
    if (!file_)
      std::memcpy(out, bytes_.data() + at, count);
    else if (file_->read_at(at, out, count) != count)
      throw failure{"the file became shorter while it was read", false, at};
  }
  /// As above; asks for no more memory than the file has bytes.
  [[nodiscard]] std::vector<char> read(std::uint64_t at, std::uint64_t count) const {
    if (at > size() || count > size() - at)
      throw failure{"the file ends in the middle of the data", false, size()};
    std::vector<char> bytes(static_cast<std::size_t>(count));
    read(at, bytes.data(), bytes.size());
    return bytes;
  }

 private:
  std::unique_ptr<input_file> file_;
  std::span<const std::byte> bytes_;
};

/// A number in the byte order of nearly all machines, whatever that of this one is.
template <class T>
T load_little(const char* data) {
  return load_number<T>(data, std::endian::native == std::endian::big);
}

template <class T>
void store_little(char* out, T value) {
  if (std::endian::native == std::endian::big) value = swap_bytes(value);
  std::memcpy(out, &value, sizeof value);
}

}  // namespace cilantro::detail
