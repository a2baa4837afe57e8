// SPDX-License-Identifier: MIT
export module cilantro.core:positive;

import cilantro.standard;
import :error;

namespace cilantro {

/// A number that is positive and finite, as an option that makes no sense otherwise.
export class positive {
 public:
  /// Throws `invalid_input` for any other number.
  positive(double value) : value_{value} {  // NOLINT: a conversion on purpose
    expects(value > 0 && std::isfinite(value),
            "a number must be positive and finite, and is " + in_digits(value));
  }
  operator double() const { return value_; }  // NOLINT

 private:
  double value_;
};

}  // namespace cilantro
