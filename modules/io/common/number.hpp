// SPDX-License-Identifier: MIT
//
// The types of numbers in files; numbers as bytes and as text. A plain header, which needs nothing
// of any module.
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string_view>
#include <system_error>
#include <utility>

namespace cilantro::detail {

/// In the order of the types of attributes.
enum class number : unsigned char {
  int8,
  uint8,
  int16,
  uint16,
  int32,
  uint32,
  float32,
  float64,
  int64,
  uint64
};

constexpr std::size_t size_of(number n) {
  constexpr std::array<std::size_t, 10> sizes{1, 1, 2, 2, 4, 4, 4, 8, 8, 8};
  return sizes[static_cast<std::size_t>(n)];
}

constexpr bool is_floating(number n) {
  return n == number::float32 || n == number::float64;
}

/// Calls `f` with a value of the C++ type of `n`.
template <class F>
decltype(auto) visit_number(number n, F&& f) {
  switch (n) {
    case number::int8:
      return f(std::int8_t{});
    case number::uint8:
      return f(std::uint8_t{});
    case number::int16:
      return f(std::int16_t{});
    case number::uint16:
      return f(std::uint16_t{});
    case number::int32:
      return f(std::int32_t{});
    case number::uint32:
      return f(std::uint32_t{});
    case number::int64:
      return f(std::int64_t{});
    case number::uint64:
      return f(std::uint64_t{});
    case number::float32:
      return f(float{});
    case number::float64:
      break;
  }
  return f(double{});
}

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
    // The largest value plus one is a power of two, which double holds exactly.
    if (!(real >= double(std::numeric_limits<T>::min()) &&
          real < std::ldexp(1.0, std::numeric_limits<T>::digits)))
      return false;
    value = static_cast<T>(real);
    return true;
  } else {
    double real = 0;
    const auto [rest, error] = std::from_chars(word.data(), end, real);
    // As run-time libraries of Windows wrote what is no number: 1.#QNAN, -1.#IND, 1.#INF.
    if (const std::string_view odd{rest, static_cast<std::size_t>(end - rest)};
        std::abs(real) == 1 && odd.starts_with('#')) {
      const bool is_infinite = odd.starts_with("#INF");
      if (!is_infinite && !odd.starts_with("#IND") && !odd.starts_with("#QNAN") &&
          !odd.starts_with("#SNAN"))
        return false;
      value = is_infinite ? static_cast<T>(real) * std::numeric_limits<T>::infinity()
                          : std::numeric_limits<T>::quiet_NaN();
      return true;
    }
    if (rest != end || word.empty()) return false;
    // Too large for a double is an error, too small for one is nothing.
    if (error == std::errc::result_out_of_range && word.find("e-") == word.npos &&
        word.find("E-") == word.npos)
      return false;
    if (error == std::errc::result_out_of_range) real = 0;
    value = static_cast<T>(real);
    if (std::isinf(value) && !std::isinf(real)) return false;
    return error == std::errc{} || error == std::errc::result_out_of_range;
  }
}

}  // namespace cilantro::detail
