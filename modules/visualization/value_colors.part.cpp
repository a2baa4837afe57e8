// SPDX-License-Identifier: MIT
//
// Colours for values, and what they mean. Internal.
module cilantro.visualization:value_colors;

import cilantro.standard;
import cilantro.core;
import :canvas;
import :color_map;

namespace cilantro {

/// The colours of values between two ends of a map.
class value_colors {
 public:
  /// An end that is not given is the lowest or highest of the values.
  value_colors(const std::vector<double>& values, const color_map& map, std::optional<double> low,
               std::optional<double> high)
      : map_{map} {
    low_ = std::numeric_limits<double>::infinity();
    high_ = -low_;
    for (const double value : values)
      if (std::isfinite(value)) {
        low_ = std::min(low_, value);
        high_ = std::max(high_, value);
      }
    if (!(low_ <= high_)) low_ = high_ = low.value_or(high.value_or(0));
    // An end that is not given makes room for the other one.
    low_ = low.value_or(std::min(low_, high.value_or(low_)));
    high_ = high.value_or(std::max(high_, low_));
    expects(std::isfinite(low_) && std::isfinite(high_) && low_ <= high_,
            "draw: .low and .high, between which values have colours, must be finite, and .low not "
            "above .high");
  }

  [[nodiscard]] rgb operator()(double value) const {
    return map_(low_ < high_ || std::isnan(value) ? (value / 2 - low_ / 2) / (high_ / 2 - low_ / 2)
                                                  : 0.5);
  }
  [[nodiscard]] color_legend legend(std::string title) const {
    color_legend legend{std::move(title), {}, low_, high_};
    constexpr int steps = 256;
    for (int i = 0; i < steps; ++i) legend.colors.push_back(map_((i + 0.5) / steps));
    return legend;
  }

 private:
  const color_map& map_;
  double low_, high_;
};

}  // namespace cilantro
