// SPDX-License-Identifier: MIT
//
// What programs that draw, and the one that writes their data, have to agree on.
#pragma once

#include <cstddef>

/// Pictures, and the diameter of the splats in them, in metres; how many points the largest cloud
/// has, and how many of them a view that moves shows.
inline constexpr int picture_width = 1280, picture_height = 720;
inline constexpr float splat_diameter = 0.012f;
inline constexpr std::ptrdiff_t picture_points = 10'000'000, moving_points = 1'000'000;
