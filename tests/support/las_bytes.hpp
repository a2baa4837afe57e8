// SPDX-License-Identifier: MIT
//
// LAS files made byte by byte, apart from the library.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

namespace test {

template <class T>
void put(std::string& bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}
inline void put_text(std::string& bytes, std::size_t at, std::string_view text) {
  std::memcpy(bytes.data() + at, text.data(), text.size());
}

/// What a LAS file is made of.
struct las_bytes {
  int minor = 2, format = 0;
  std::uint16_t record_length = 20;
  double scale = 0.01, offset = 0;
  std::string records = {};  ///< Variable length records, as they are.
  std::uint32_t record_count = 0;
  std::string points = {};
  std::string extended = {};  ///< Those behind the points.
  std::uint32_t extended_count = 0;

  void add_record(std::string_view user, std::uint16_t id, std::string_view description,
                  std::string_view data) {
    std::string head(54, '\0');
    put_text(head, 2, user);
    put(head, 18, id);
    put(head, 20, static_cast<std::uint16_t>(data.size()));
    put_text(head, 22, description);
    records += head;
    records += data;
    ++record_count;
  }
  void add_extended(std::string_view user, std::uint16_t id, std::string_view data) {
    std::string head(60, '\0');
    put_text(head, 2, user);
    put(head, 18, id);
    put(head, 20, static_cast<std::uint64_t>(data.size()));
    extended += head;
    extended += data;
    ++extended_count;
  }

  [[nodiscard]] std::size_t header_size() const {
    return minor == 4 ? 375 : minor == 3 ? 235 : 227;
  }
  [[nodiscard]] std::size_t points_at() const { return header_size() + records.size(); }
  [[nodiscard]] std::uint64_t count() const { return points.size() / record_length; }

  [[nodiscard]] std::string file() const {
    std::string header(header_size(), '\0');
    put_text(header, 0, "LASF");
    put(header, 4, std::uint16_t{7});
    if (minor >= 2) put(header, 6, std::uint16_t{1});
    put_text(header, 8, "project number 1");
    header[24] = 1;
    header[25] = static_cast<char>(minor);
    put_text(header, 26, "a sensor");
    put_text(header, 58, "a test");
    put(header, 90, std::uint16_t{123});
    put(header, 92, std::uint16_t{2025});
    put(header, 94, static_cast<std::uint16_t>(header.size()));
    put(header, 96, static_cast<std::uint32_t>(points_at()));
    put(header, 100, record_count);
    header[104] = static_cast<char>(format);
    put(header, 105, record_length);
    if (format < 6) put(header, 107, static_cast<std::uint32_t>(count()));
    for (std::size_t d = 0; d < 3; ++d) {
      put(header, 131 + 8 * d, scale);
      put(header, 155 + 8 * d, offset);
      put(header, 179 + 16 * d, offset + 1000.0);
      put(header, 187 + 16 * d, offset - 1000.0);
    }
    if (minor == 4) {
      put(header, 235, std::uint64_t{extended_count > 0 ? points_at() + points.size() : 0});
      put(header, 243, extended_count);
      put(header, 247, count());
    }
    return header + records + points + extended;
  }
};

/// The 192 bytes that describe a value of extra bytes.
inline std::string extra_bytes(std::string_view name, int type, int options = 0, double scale = 0,
                               double offset = 0) {
  std::string bytes(192, '\0');
  bytes[2] = static_cast<char>(type);
  bytes[3] = static_cast<char>(options);
  put_text(bytes, 4, name);
  put(bytes, 112, scale);
  put(bytes, 136, offset);
  return bytes;
}

}  // namespace test
