// SPDX-License-Identifier: MIT
module cilantro.visualization;

import cilantro.core;

namespace cilantro {

/// A channel, from 0 to 1, as 8 bits.
static std::uint8_t to_byte(double channel) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(channel, 0.0, 1.0)));
}

/// A smooth curve through colours that are evenly spaced from 0 to 1: Catmull and Rom's spline,
/// which beyond either end goes on as the parabola through the last three.
template <std::size_t N>
static rgb interpolated(const std::array<rgb, N>& colors, double share) {
  constexpr int last = N - 1;
  const int i = std::min(static_cast<int>(share * last), last - 1);
  const double t = share * last - i;
  rgb color;
  for (const std::size_t channel : {0, 1, 2}) {
    const auto at = [&](int k) { return static_cast<double>(colors[k][channel]); };
    const double from = at(i), to = at(i + 1);
    const double before = i > 0 ? at(i - 1) : 3 * (at(0) - at(1)) + at(2);
    const double after = i + 1 < last ? at(i + 2) : 3 * (at(last) - at(last - 1)) + at(last - 2);
    const double value =
        from +
        t / 2 *
            (to - before +
             t * (2 * before - 5 * from + 4 * to - after + t * (3 * (from - to) + after - before)));
    color[channel] = to_byte(value / 255);
  }
  return color;
}

rgb turbo(double share) {
  // Every fifteenth of the 256 published.
  static constexpr std::array colors = {
      rgb{48, 18, 59},   rgb{63, 62, 156},  rgb{70, 102, 221}, rgb{69, 140, 253}, rgb{47, 178, 244},
      rgb{26, 212, 208}, rgb{34, 235, 170}, rgb{82, 250, 122}, rgb{139, 255, 75}, rgb{183, 247, 53},
      rgb{219, 226, 54}, rgb{245, 197, 58}, rgb{254, 161, 48}, rgb{249, 117, 29}, rgb{232, 75, 12},
      rgb{206, 45, 4},   rgb{169, 22, 1},   rgb{122, 4, 3}};
  return interpolated(colors, share);
}

rgb viridis(double share) {
  // Every fifteenth of the 256 published.
  static constexpr std::array colors = {
      rgb{68, 1, 84},    rgb{72, 23, 105},  rgb{71, 42, 122},  rgb{67, 61, 132},  rgb{61, 78, 138},
      rgb{53, 94, 141},  rgb{46, 109, 142}, rgb{41, 123, 142}, rgb{35, 137, 142}, rgb{31, 151, 139},
      rgb{33, 165, 133}, rgb{46, 179, 124}, rgb{70, 192, 111}, rgb{101, 203, 94}, rgb{137, 213, 72},
      rgb{176, 221, 47}, rgb{216, 226, 25}, rgb{253, 231, 37}};
  return interpolated(colors, share);
}

rgb gray_scale(double share) {
  const std::uint8_t value = to_byte(share);
  return {value, value, value};
}

rgb blue_to_red(double share) {
  // Every other of the 33 published.
  static constexpr std::array colors = {rgb{59, 76, 192},   rgb{77, 104, 215},  rgb{98, 130, 234},
                                        rgb{119, 154, 247}, rgb{141, 176, 254}, rgb{163, 194, 255},
                                        rgb{184, 208, 249}, rgb{204, 217, 238}, rgb{221, 221, 221},
                                        rgb{236, 211, 197}, rgb{245, 196, 173}, rgb{247, 177, 148},
                                        rgb{244, 154, 123}, rgb{236, 127, 99},  rgb{222, 96, 77},
                                        rgb{203, 62, 56},   rgb{180, 4, 38}};
  return interpolated(colors, share);
}

rgb jet(double share) {
  const auto channel = [&](double middle) { return to_byte(1.5 - 4 * std::abs(share - middle)); };
  return {channel(0.75), channel(0.5), channel(0.25)};
}

}  // namespace cilantro
