// SPDX-License-Identifier: MIT
module;
#include <array>
#include <charconv>
#include <string>
module cilantro.core;

namespace cilantro {

std::string in_digits(double value) {
  std::array<char, 32> digits;
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr};
}

}  // namespace cilantro
