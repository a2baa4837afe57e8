// SPDX-License-Identifier: MIT
//
// Which pixels large splats and discs cover, compiled for each vector target. Internal.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/vector_kernels.hpp"

namespace cilantro::detail {

/// From the camera's coordinates to the middles of pixels.
struct pixel_grid {
  float fx, fy, cx, cy;
  bool orthographic;
  int width, height;
};

/// A splat that is a disc across a normal, in the camera's coordinates.
struct disc_shape {
  float x, y;  ///< Of its middle, in pixels.
  float normal[3], middle[3];
  float along, square;  ///< The normal times the middle; the squared radius.
};

/// Sixteen pixels, in rows of 4, 8 or 16 from (x, y) on; what is beyond the last is not covered.
struct pixel_block {
  int columns, x, y, last_x, last_y;
};
/// Of the middles of pixels, row by row: the squared distance from the middle of the disc, in its
/// plane, as a share of the squared radius; and the depth there. Of the pixel that has the middle
/// of the disc, if it is not covered otherwise: four times the squared distance in the picture; and
/// the depth of the middle.
struct covered_block {
  float shares[16], depths[16];
};
/// Bit i is whether pixel i is covered; only of these shares and depths are of use.
using cover_by_disc = unsigned(const disc_shape& disc, const pixel_grid& grid,
                               const pixel_block& block, covered_block& out);

struct round_splat {
  float x, y, radius;  ///< In pixels.
  int first_row, last_row;
};
/// Behind the end of a picture there is room for so many more.
inline constexpr std::size_t keys_behind = 7;
/// Each pixel that is covered keeps the lesser of its key and that of the splat.
using keep_least_of_round = void(const round_splat& splat, std::int64_t key, const pixel_grid& grid,
                                 std::int64_t* pixels);

/// The weighted sum of colours in a pixel, as integers: the order does not matter. Two parts of 32
/// bits each, which no sum exceeds.
struct color_sum {
  std::uint64_t red_green = 0, blue_weight = 0;
};
/// A round splat to be mixed, and what it adds with a weight of 1.
struct mixed_splat {
  round_splat round;
  float z, diameter;  ///< It counts down to its diameter behind what is nearest in a pixel.
  color_sum own;
  std::uint32_t
      points;       ///< Lower numbers of what is nearest are points, on which splats are mixed.
  int most_weight;  ///< In the middle; 1 at the border.
};
/// Adds to the sums of pixels, `nearest` being their keys; room as above behind both.
using mix_round = void(const mixed_splat& splat, const std::int64_t* nearest,
                       const pixel_grid& grid, color_sum* sums);

struct splat_kernels {
  cover_by_disc* cover_by_disc;
  keep_least_of_round* keep_least_of_round;
  mix_round* mix_round;
};
/// What the units for each target instantiate.
template <kernel_target V>
splat_kernels splat_kernels_in();

}  // namespace cilantro::detail
