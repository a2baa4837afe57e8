// SPDX-License-Identifier: MIT
//
// The content of an E57 file, which is cut into pages with checksums. A plain header, which needs
// nothing of any module.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "io/common/random_bytes.hpp"

namespace cilantro::e57 {

/// CRC-32C, by tables of eight bytes at a time.
class checksum {
 public:
  static std::uint32_t of(const char* data, std::size_t size) {
    std::uint32_t sum = ~0u;
    for (; size >= 8; data += 8, size -= 8) {
      const auto word = detail::load_little<std::uint64_t>(data) ^ sum;
      sum = 0;
      for (std::size_t i = 0; i < 8; ++i) sum ^= tables()[7 - i][(word >> (8 * i)) & 255u];
    }
    for (; size > 0; ++data, --size)
      sum = sum >> 8 ^ tables()[0][(sum ^ static_cast<unsigned char>(*data)) & 255u];
    return ~sum;
  }

 private:
  using table = std::array<std::uint32_t, 256>;

  static const std::array<table, 8>& tables() {
    static constexpr auto all = [] {
      std::array<table, 8> made{};
      for (std::uint32_t i = 0; i < 256; ++i) {
        std::uint32_t sum = i;
        for (int bit = 0; bit < 8; ++bit) sum = sum >> 1 ^ (sum & 1u ? 0x82f63b78u : 0u);
        made[0][i] = sum;
      }
      for (std::size_t t = 1; t < 8; ++t)
        for (std::size_t i = 0; i < 256; ++i)
          made[t][i] = made[t - 1][i] >> 8 ^ made[0][made[t - 1][i] & 255u];
      return made;
    }();
    return all;
  }
};

/// The bytes without the checksums. Places in the file count these, places in the content do not.
class pages {
 public:
  static constexpr std::size_t size = 1024, payload = size - 4;

  explicit pages(const detail::random_bytes& file) : file_{file} {}

  [[nodiscard]] std::uint64_t file_size() const { return file_.size(); }
  /// The place in the content of byte `at` of the file. Throws `detail::failure` if there is none.
  [[nodiscard]] std::uint64_t content_place(std::uint64_t at) const {
    if (at >= file_.size() || at % size >= payload)
      throw detail::failure{
          "the file refers to byte " + std::to_string(at) + ", where it has no data", false, at};
    return at / size * payload + at % size;
  }
  [[nodiscard]] static std::uint64_t file_place(std::uint64_t content) {
    return content / payload * size + content % payload;
  }

  /// The `count` bytes of the content from `at` on. Throws `detail::failure` if the file ends
  /// before, or if a checksum does not fit.
  [[nodiscard]] std::vector<char> read(std::uint64_t at, std::uint64_t count) const {
    if (count > file_.size() || at > file_.size())
      throw detail::failure{"the file ends in the middle of the data", false, file_.size()};
    std::vector<char> content(static_cast<std::size_t>(count));
    std::array<char, size> page;
    for (std::size_t done = 0; done < content.size();) {
      const std::uint64_t index = (at + done) / payload;
      const auto from = static_cast<std::size_t>((at + done) % payload);
      file_.read(index * size, page.data(), size);
      // The checksum is the only number whose highest byte comes first.
      std::uint32_t noted = 0;
      for (std::size_t i = payload; i < size; ++i)
        noted = noted << 8 | static_cast<unsigned char>(page[i]);
      if (checksum::of(page.data(), payload) != noted)
        throw detail::failure{"page " + std::to_string(index) +
                                  " is damaged: its checksum does "
                                  "not fit",
                              false, index * size};
      const std::size_t part = std::min(content.size() - done, payload - from);
      std::memcpy(content.data() + done, page.data() + from, part);
      done += part;
    }
    return content;
  }

 private:
  const detail::random_bytes& file_;
};

}  // namespace cilantro::e57
