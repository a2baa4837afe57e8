// SPDX-License-Identifier: MIT
//
// Numbers in a PLY file, as bytes and as text. A plain header, which needs nothing of any module.
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstring>
#include <limits>
#include <string_view>
#include <system_error>
#include <utility>

namespace cilantro::ply {

/// Turns a value between the byte orders of the file and of the machine.
template <class T>
T swap_bytes(T value) {
  std::array<char, sizeof(T)> bytes;
  std::memcpy(bytes.data(), &value, sizeof(T));
  for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(bytes[i], bytes[sizeof(T) - 1 - i]);
  std::memcpy(&value, bytes.data(), sizeof(T));
  return value;
}

template <class T>
T load_number(const char* data, bool swap) {
  T value;
  std::memcpy(&value, data, sizeof(T));
  return swap ? swap_bytes(value) : value;
}

/// A number written in text. Integers may be written like 3.0.
template <class T>
bool parse_number(std::string_view word, T& value) {
  if (word.starts_with('+')) word.remove_prefix(1);
  const char* end = word.data() + word.size();
  if constexpr (std::integral<T>) {
    const auto [rest, error] = std::from_chars(word.data(), end, value);
    if (error == std::errc{} && rest == end) return true;
    double real;
    if (!parse_number(word, real) || real != std::floor(real)) return false;
    if (!(real >= double(std::numeric_limits<T>::min()) &&
          real <= double(std::numeric_limits<T>::max())))
      return false;
    value = static_cast<T>(real);
    return true;
  } else {
    double real = 0;
    const auto [rest, error] = std::from_chars(word.data(), end, real);
    if (rest != end || word.empty()) return false;
    // Too large for a double is an error, too small for one is nothing.
    if (error == std::errc::result_out_of_range && word.find("e-") == word.npos &&
        word.find("E-") == word.npos)
      return false;
    if (error == std::errc::result_out_of_range) real = 0;
    value = static_cast<T>(real);
    return error == std::errc{} || error == std::errc::result_out_of_range;
  }
}

}  // namespace cilantro::ply
