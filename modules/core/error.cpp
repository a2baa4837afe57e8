// SPDX-License-Identifier: MIT
module cilantro.core;

namespace cilantro {

std::string in_digits(double value) {
  std::array<char, 32> digits;
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr};
}

void expect_from(double least, double value, const char* what) {
  if (!(value >= least))
    throw invalid_input{std::string{what} + " must be " + in_digits(least) + " or more, and is " +
                        in_digits(value)};
}

void expect_between(double least, double value, double most, const char* what) {
  if (most == std::numeric_limits<double>::max() && !(least <= value && value <= most))
    throw invalid_input{std::string{what} + " must be " + in_digits(least) +
                        " or more and finite, and is " + in_digits(value)};
  if (!(least <= value && value <= most))
    throw invalid_input{std::string{what} + " must be from " + in_digits(least) + " to " +
                        in_digits(most) + ", and is " + in_digits(value)};
}

}  // namespace cilantro
