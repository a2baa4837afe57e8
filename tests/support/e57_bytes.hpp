// SPDX-License-Identifier: MIT
//
// E57 files made byte by byte, apart from the library.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "las_bytes.hpp"

namespace test::e57 {

constexpr std::size_t payload = 1020;

/// Bit by bit, as it is defined.
inline std::uint32_t checksum(std::string_view data) {
  std::uint32_t sum = ~0u;
  for (const char c : data) {
    sum ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) sum = sum >> 1 ^ (sum & 1u ? 0x82f63b78u : 0u);
  }
  return ~sum;
}

/// Numbers of so many bits one after another.
class bits {
 public:
  explicit bits(unsigned each) : each_{each} {}
  bits& add(std::uint64_t value) {
    for (unsigned i = 0; i < each_; ++i, ++count_) {
      if (count_ % 8 == 0) bytes_ += '\0';
      if (value >> i & 1)
        bytes_.back() =
            static_cast<char>(static_cast<unsigned char>(bytes_.back()) | 1u << count_ % 8);
    }
    return *this;
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  unsigned each_;
  std::size_t count_ = 0;
  std::string bytes_;
};

template <class T>
std::string raw(const std::vector<T>& values) {
  std::string bytes(values.size() * sizeof(T), '\0');
  for (std::size_t i = 0; i < values.size(); ++i) put(bytes, i * sizeof(T), values[i]);
  return bytes;
}

/// Collects the content of a file, then cuts it into pages.
class file {
 public:
  /// A section with the streams of a scan, in packets with at most `piece` bytes of each stream.
  /// Returns its place in the file.
  std::size_t add_points(const std::vector<std::string>& streams, std::size_t piece = 100) {
    align();
    const std::size_t begin = content_.size();
    std::string section(32, '\0');
    section[0] = 1;
    put(section, 16, static_cast<std::uint64_t>(place(begin + 32)));
    // An index, which is passed over.
    std::string index(16, '\0');
    put(index, 2, std::uint16_t{15});
    section += index;
    std::size_t longest = 0;
    for (const auto& s : streams) longest = std::max(longest, s.size());
    for (std::size_t at = 0; at < longest; at += piece) {
      std::string packet(6 + 2 * streams.size(), '\0');
      packet[0] = 1;
      put(packet, 4, static_cast<std::uint16_t>(streams.size()));
      for (std::size_t i = 0; i < streams.size(); ++i) {
        const std::string part = at < streams[i].size() ? streams[i].substr(at, piece) : "";
        put(packet, 6 + 2 * i, static_cast<std::uint16_t>(part.size()));
        packet += part;
      }
      packet.resize((packet.size() + 3) / 4 * 4);
      put(packet, 2, static_cast<std::uint16_t>(packet.size() - 1));
      section += packet;
    }
    put(section, 8, static_cast<std::uint64_t>(section.size()));
    content_ += section;
    return place(begin);
  }

  /// The file, with the elements of the scans as its XML part.
  [[nodiscard]] std::string bytes(const std::string& scans) const {
    std::string content = content_;
    content.resize((content.size() + 3) / 4 * 4);
    const std::size_t xml_at = content.size();
    const std::string xml =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!-- made by a test -->\n"
        "<e57Root type=\"Structure\"><data3D type='Vector'>" +
        scans + "</data3D></e57Root>\n";
    content += xml;
    const std::size_t pages = (content.size() + payload - 1) / payload;
    content.resize(pages * payload);
    put_text(content, 0, "ASTM-E57");
    put(content, 8, std::uint32_t{1});
    put(content, 16, static_cast<std::uint64_t>(pages * 1024));
    put(content, 24, static_cast<std::uint64_t>(place(xml_at)));
    put(content, 32, static_cast<std::uint64_t>(xml.size()));
    put(content, 40, std::uint64_t{1024});
    return paged(content);
  }

  static std::string paged(const std::string& content) {
    std::string all;
    for (std::size_t at = 0; at < content.size(); at += payload) {
      const std::string page = content.substr(at, payload);
      const std::uint32_t sum = checksum(page);
      all += page;
      for (int shift = 24; shift >= 0; shift -= 8) all += static_cast<char>(sum >> shift);
    }
    return all;
  }
  /// The content of a file without the checksums.
  static std::string content_of(const std::string& file) {
    std::string all;
    for (std::size_t at = 0; at < file.size(); at += 1024) all += file.substr(at, payload);
    return all;
  }

 private:
  void align() { content_.resize((content_.size() + 3) / 4 * 4); }
  static std::size_t place(std::size_t content) {
    return content / payload * 1024 + content % payload;
  }

  std::string content_ = std::string(48, '\0');
};

/// The element of a scan.
inline std::string scan(std::size_t at, std::size_t count, const std::string& prototype,
                        const std::string& more = "") {
  return "<vectorChild type=\"Structure\">" + more +
         "<points type=\"CompressedVector\" fileOffset=\"" + std::to_string(at) +
         "\" recordCount=\"" + std::to_string(count) + "\"><prototype type=\"Structure\">" +
         prototype + "</prototype></points></vectorChild>";
}

}  // namespace test::e57
