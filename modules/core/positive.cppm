// SPDX-License-Identifier: MIT
export module cilantro.core:positive;

import cilantro.standard;
import :error;

namespace cilantro {

/// A number for options that must be above 0 and finite: made from a double, it throws
/// `invalid_input` otherwise.
export class positive {
 public:
  /// Throws `invalid_input` unless 0 < value < ∞.
  positive(double value) : value_{value} {  // NOLINT: a conversion on purpose
    expects(value > 0 && std::isfinite(value),
            "a number must be positive and finite, and is " + in_digits(value));
  }
  operator double() const { return value_; }  // NOLINT

 private:
  double value_;
};

}  // namespace cilantro
