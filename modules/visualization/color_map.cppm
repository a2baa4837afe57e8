// SPDX-License-Identifier: MIT
//
// Colours for numbers: of a scale by color maps, of clusters by label.
export module cilantro.visualization:color_map;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// A rainbow without the false edges of `jet`: dark blue, green, dark red. It shows most detail.
/// Within 2/255 of the published table.
/// Source: Mikhailov 2019, "Turbo, an improved rainbow colormap for visualization". His polynomials
/// are up to 32/255 off that table, so it is interpolated instead. Precondition, here and for the
/// maps below: 0 <= share <= 1.
export [[nodiscard]] rgb turbo(double share);

/// From dark blue over green to yellow: equal steps look equally large, also printed in grey and to
/// the colour blind. Within 1/255 of the published table.
/// Source: van der Walt & Smith 2015, "A better default colormap for Matplotlib".
export [[nodiscard]] rgb viridis(double share);

/// From black to white.
export [[nodiscard]] rgb gray_scale(double share);

/// From blue to red, light grey in the middle: for values that differ from a reference in either
/// direction. Equal to the published table of 33 colours in every other of them, and within 4/255
/// of the others.
/// Source: Moreland 2009, "Diverging color maps for scientific visualization".
export [[nodiscard]] rgb blue_to_red(double share);

/// The rainbow from dark blue over cyan and yellow to dark red that MATLAB once made usual: for
/// pictures beside others drawn with it. Its bands suggest edges where there are none: prefer
/// `turbo`.
export [[nodiscard]] rgb jet(double share);

/// A function of a share from 0 to 1 that returns a colour, as `turbo` is.
export template <class F>
concept ColorFunction = std::is_invocable_r_v<rgb, const F&, double>;

/// Colours for shares from 0 to 1: a `ColorFunction` of any type, by default `turbo`.
///
/// The function is called when the map is made, for a table of 1025 colours, and not again: a
/// colour costs the same whatever the function does, and is that of a share at most 1/2048 away.
export class color_map {
 public:
  color_map() : color_map{turbo} {}
  template <class F>
    requires(!std::same_as<F, color_map>) && ColorFunction<F>
  color_map(const F& function) {  // NOLINT: a conversion on purpose
    for (index_t i = 0; i <= steps; ++i) table_[i] = function(static_cast<double>(i) / steps);
  }

  /// The colour of a share; beyond 0 and 1 that of 0 and 1, and `unknown` for NaN.
  [[nodiscard]] rgb operator()(double share) const {
    if (std::isnan(share)) return unknown;
    return table_[static_cast<index_t>(std::min(std::max(share, 0.0), 1.0) * steps + 0.5)];
  }

  /// The colour of values that are not known. Magenta, since it is far from all colours of the maps
  /// above, where a grey would be one of `gray_scale` and of the middle of `blue_to_red`.
  rgb unknown{255, 0, 255};

 private:
  static constexpr index_t steps = 1024;
  std::array<rgb, steps + 1> table_;
};

}  // namespace cilantro
