// SPDX-License-Identifier: MIT
#include "io/e57/e57_points.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/common/byte_stream.hpp"
#include "io/common/number.hpp"
#include "io/common/random_bytes.hpp"

namespace cilantro::e57 {
namespace {

using detail::failure;
using detail::load_little;

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(" \t\r\n");
  if (begin == text.npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r\n") + 1 - begin);
}

template <class T>
T number_in(std::string_view text) {
  T value{};
  const auto word = trimmed(text);
  if (!word.empty() && !detail::parse_number(word, value))
    throw failure{'"' + std::string{word.substr(0, 40)} + "\" is no number", false, 0};
  return value;
}

/// How many bits tell the values from `lowest` to `highest` apart.
unsigned bits_between(std::int64_t lowest, std::int64_t highest) {
  const std::uint64_t range =
      static_cast<std::uint64_t>(highest) - static_cast<std::uint64_t>(lowest);
  return static_cast<unsigned>(std::bit_width(range));
}

field parse_field(const element& e) {
  field f{.name = e.name};
  const auto type = e.attribute("type");
  if (type == "Float") {
    f.as = field::form::real;
    f.bits = e.attribute("precision") == "single" ? 32 : 64;
  } else if (type == "Integer" || type == "ScaledInteger") {
    const auto low = e.attribute("minimum"), high = e.attribute("maximum");
    f.lowest = low.empty() ? std::numeric_limits<std::int64_t>::min() : integer_in(low);
    f.highest = high.empty() ? std::numeric_limits<std::int64_t>::max() : integer_in(high);
    if (f.lowest > f.highest)
      throw failure{"the limits of \"" + f.name + "\" are the wrong way round", false, 0};
    f.bits = bits_between(f.lowest, f.highest);
    f.is_scaled = type == "ScaledInteger";
    const auto scale = e.attribute("scale");
    if (f.is_scaled) {
      f.scale = scale.empty() ? 1 : real_in(scale);
      f.offset = real_in(e.attribute("offset"));
    }
  } else if (type == "String") {
    f.as = field::form::text;
  } else {
    throw failure{"\"" + f.name + "\" is of the type \"" + std::string{type} +
                      "\", which a value of a point cannot be",
                  false, 0};
  }
  return f;
}

/// Takes values apart that were packed bit by bit, from pieces of a stream of bytes.
class unpacker {
 public:
  unpacker(const field& f, std::uint64_t count) : field_{f}, count_{count} {}

  /// Goes on with more bytes, of which those of an incomplete value are kept.
  void add(const char* data, std::size_t size, std::vector<double>& out) {
    if (field_.as == field::form::text) return;
    if (field_.bits == 0) return;
    kept_.insert(kept_.end(), data, data + size);
    const std::uint64_t bits = std::uint64_t{kept_.size()} * 8;
    // Room for a load of eight bytes anywhere.
    kept_.resize(kept_.size() + 16);
    std::uint64_t at = first_bit_;
    for (; at + field_.bits <= bits && out.size() < count_; at += field_.bits)
      out.push_back(value(at));
    kept_.resize(kept_.size() - 16);
    kept_.erase(kept_.begin(), kept_.begin() + static_cast<std::ptrdiff_t>(at / 8));
    first_bit_ = at % 8;
  }

 private:
  [[nodiscard]] double value(std::uint64_t at) const {
    const char* data = kept_.data() + at / 8;
    const auto shift = static_cast<unsigned>(at % 8);
    std::uint64_t raw = load_little<std::uint64_t>(data) >> shift;
    if (shift > 0) raw |= std::uint64_t{static_cast<unsigned char>(data[8])} << (64 - shift);
    if (field_.as == field::form::real)
      return field_.bits == 32 ? double{std::bit_cast<float>(static_cast<std::uint32_t>(raw))}
                               : std::bit_cast<double>(raw);
    if (field_.bits < 64) raw &= (std::uint64_t{1} << field_.bits) - 1;
    const auto integer = static_cast<std::int64_t>(raw + static_cast<std::uint64_t>(field_.lowest));
    if (integer > field_.highest || integer < field_.lowest)
      throw failure{"a value of \"" + field_.name + "\" is beyond its limits", false, 0};
    return static_cast<double>(integer) * field_.scale + field_.offset;
  }

  const field& field_;
  std::uint64_t count_, first_bit_ = 0;
  std::vector<char> kept_;
};

/// Gives each packet of a section's data to `f`.
template <class F>
void for_each_packet(const pages& file, const points_section& section, std::uint64_t& left, F f) {
  const std::uint64_t begin = file.content_place(section.at);
  const auto head = file.read(begin, 32);
  if (head[0] != 1) throw failure{"the points do not begin as such", false, section.at};
  const auto length = load_little<std::uint64_t>(head.data() + 8);
  std::uint64_t at = file.content_place(load_little<std::uint64_t>(head.data() + 16));
  const std::uint64_t end = begin + std::min(length, file.file_size());
  while (at < end) {
    const auto start = file.read(at, 4);
    const std::uint64_t size = std::uint64_t{load_little<std::uint16_t>(start.data() + 2)} + 1;
    constexpr char data_packet = 1, last_type = 2;
    if (start[0] < 0 || start[0] > last_type || size < 4)
      throw failure{"a packet of points is malformed", false, pages::file_place(at)};
    if (size > left)
      throw failure{"the scans have the same packets of points", false, pages::file_place(at)};
    left -= size;
    if (start[0] == data_packet && f(file.read(at, size), at)) return;
    at += size;
  }
}

}  // namespace

double real_in(std::string_view text) {
  return number_in<double>(text);
}

std::int64_t integer_in(std::string_view text) {
  return number_in<std::int64_t>(text);
}

number field::type() const {
  if (as == form::real) return bits == 32 ? number::float32 : number::float64;
  if (is_scaled) return number::float64;
  const auto holds = [&]<class T>(T) {
    return lowest >= std::numeric_limits<T>::min() && highest <= std::numeric_limits<T>::max();
  };
  if (holds(std::uint8_t{})) return number::uint8;
  if (holds(std::int8_t{})) return number::int8;
  if (holds(std::uint16_t{})) return number::uint16;
  if (holds(std::int16_t{})) return number::int16;
  if (holds(std::uint32_t{})) return number::uint32;
  if (holds(std::int32_t{})) return number::int32;
  // Integers beyond 2^53 are rounded, as a double is.
  return number::float64;
}

points_section parse_points(const element& points, std::uint64_t file_size) {
  const element* prototype = points.child("prototype");
  if (points.attribute("type") != "CompressedVector" || prototype == nullptr)
    throw failure{"the points of a scan are not described", false, 0};
  points_section section;
  const std::int64_t at = integer_in(points.attribute("fileOffset")),
                     count = integer_in(points.attribute("recordCount"));
  if (at < 0 || count < 0) throw failure{"a scan has a negative number of points", false, 0};
  section.at = static_cast<std::uint64_t>(at);
  section.count = static_cast<std::uint64_t>(count);
  std::uint64_t bits = 0;
  for (const element& e : prototype->children) {
    section.fields.push_back(parse_field(e));
    bits += section.fields.back().bits;
  }
  // Points that differ take a bit at least.
  if (section.count > file_size * 8 / std::max<std::uint64_t>(bits, 1))
    throw failure{"a scan promises " + std::to_string(section.count) + " points of " +
                      std::to_string(bits) + " bits, for which the file is too short",
                  false, section.at < file_size ? section.at : 0};
  return section;
}

std::vector<std::vector<double>> read_points(const pages& file, const points_section& section,
                                             std::uint64_t& left,
                                             const std::function<void(std::uint64_t)>& progress) {
  const std::size_t n = section.fields.size();
  std::vector<std::vector<double>> columns(n);
  std::vector<unpacker> unpackers;
  for (std::size_t f = 0; f < n; ++f) {
    const field& what = section.fields[f];
    unpackers.emplace_back(what, section.count);
    if (what.as == field::form::integer && what.bits == 0)
      columns[f].assign(static_cast<std::size_t>(section.count),
                        static_cast<double>(what.lowest) * what.scale + what.offset);
    else if (what.as != field::form::text)
      columns[f].reserve(static_cast<std::size_t>(section.count));
  }
  const auto done = [&] {
    std::uint64_t least = section.count;
    for (std::size_t f = 0; f < n; ++f)
      if (section.fields[f].as != field::form::text)
        least = std::min<std::uint64_t>(least, columns[f].size());
    return least;
  };
  if (section.count > 0)
    for_each_packet(file, section, left, [&](const std::vector<char>& packet, std::uint64_t at) {
      progress(done());
      const auto malformed = [&] {
        throw failure{"a packet of points is malformed", false, pages::file_place(at)};
      };
      if (packet.size() < 6 || load_little<std::uint16_t>(packet.data() + 4) != n) malformed();
      std::size_t next = 6 + 2 * n;
      if (next > packet.size()) malformed();
      for (std::size_t f = 0; f < n; ++f) {
        const std::size_t size = load_little<std::uint16_t>(packet.data() + 6 + 2 * f);
        if (size > packet.size() - next) malformed();
        unpackers[f].add(packet.data() + next, size, columns[f]);
        next += size;
      }
      return done() == section.count;
    });
  if (done() != section.count)
    throw failure{"a scan promises " + std::to_string(section.count) + " points, and " +
                      std::to_string(done()) + " are there",
                  false, section.at};
  return columns;
}

}  // namespace cilantro::e57
