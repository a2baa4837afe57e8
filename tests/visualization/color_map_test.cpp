// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <utility>
#include <vector>

import cilantro;
import cilantro.visualization;

using namespace cilantro;

namespace {

constexpr std::array maps = {turbo, viridis, gray_scale, blue_to_red, jet};

/// The largest difference of a channel.
int difference(rgb a, rgb b) {
  int largest = 0;
  for (index_t c = 0; c < 3; ++c) largest = std::max(largest, std::abs(a[c] - b[c]));
  return largest;
}

/// CIE 1976 L*a*b* of an sRGB colour under D65, where distances are about as large as they look.
Eigen::Vector3d lab(rgb color) {
  Eigen::Vector3d linear;
  for (index_t c = 0; c < 3; ++c) {
    const double v = color[c] / 255.0;
    linear[c] = v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  }
  const Eigen::Matrix3d to_xyz{
      {0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}};
  const Eigen::Vector3d white{0.9505, 1, 1.089};
  Eigen::Vector3d f = (to_xyz * linear).cwiseQuotient(white);
  for (double& v : f) v = v > 0.008856 ? std::cbrt(v) : 7.787 * v + 16.0 / 116;
  return {116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])};
}

/// The colour of one label.
rgb label_color(clusters::label label) {
  const auto color = label_colors(std::array{label});
  return {std::uint8_t(255 * color(0) + 0.5f), std::uint8_t(255 * color(1) + 0.5f),
          std::uint8_t(255 * color(2) + 0.5f)};
}

}  // namespace

// From matplotlib 3.6.3: entries 0, 32, …, 224 and 255 of its tables of 256 colours.
TEST_CASE("turbo and viridis are those that were published, to 2 of 255") {
  using colors = std::vector<std::pair<int, rgb>>;
  for (const auto& [entry, color] : colors{{0, {48, 18, 59}},
                                           {32, {70, 107, 227}},
                                           {64, {40, 188, 235}},
                                           {96, {50, 242, 152}},
                                           {128, {164, 252, 60}},
                                           {160, {238, 207, 58}},
                                           {192, {251, 126, 33}},
                                           {224, {208, 47, 5}},
                                           {255, {122, 4, 3}}}) {
    CAPTURE(entry);
    CHECK(difference(turbo(entry / 255.0), color) <= 2);
  }
  for (const auto& [entry, color] : colors{{0, {68, 1, 84}},
                                           {32, {71, 45, 123}},
                                           {64, {59, 82, 139}},
                                           {96, {44, 114, 142}},
                                           {128, {33, 145, 140}},
                                           {160, {40, 174, 128}},
                                           {192, {94, 201, 98}},
                                           {224, {173, 220, 48}},
                                           {255, {253, 231, 37}}}) {
    CAPTURE(entry);
    CHECK(difference(viridis(entry / 255.0), color) <= 1);
  }
}

// Entries of the table of 33 colours that comes with the publication, those that are interpolated.
TEST_CASE(
    "the diverging map is the one that was published, to 4 of 255, and neutral in the middle") {
  using colors = std::vector<std::pair<int, rgb>>;
  for (const auto& [entry, color] : colors{{1, {68, 90, 204}},
                                           {7, {130, 165, 251}},
                                           {15, {213, 219, 230}},
                                           {17, {229, 216, 209}},
                                           {25, {241, 141, 111}},
                                           {31, {192, 40, 47}}}) {
    CAPTURE(entry);
    CHECK(difference(blue_to_red(entry / 32.0), color) <= 4);
  }
  CHECK(blue_to_red(0) == rgb{59, 76, 192});
  CHECK(blue_to_red(0.5) == rgb{221, 221, 221});
  CHECK(blue_to_red(1) == rgb{180, 4, 38});
}

TEST_CASE("jet passes the corners of MATLAB's") {
  CHECK(jet(0) == rgb{0, 0, 128});
  CHECK(jet(0.125) == rgb{0, 0, 255});
  CHECK(jet(0.375) == rgb{0, 255, 255});
  CHECK(jet(0.5) == rgb{128, 255, 128});
  CHECK(jet(0.625) == rgb{255, 255, 0});
  CHECK(jet(0.875) == rgb{255, 0, 0});
  CHECK(jet(1) == rgb{128, 0, 0});
}

TEST_CASE("the grey scale is even, from black to white") {
  for (int i = 0; i < 256; ++i) {
    const auto grey = static_cast<std::uint8_t>(i);
    CHECK(gray_scale(i / 255.0) == rgb{grey, grey, grey});
  }
}

TEST_CASE("a color map has the colours of its function, to a level where it rises steeply") {
  for (const auto map : maps) {
    const color_map colors = map;
    int largest = 0;
    for (int i = 0; i <= 10'000; ++i)
      largest = std::max(largest, difference(colors(i / 10'000.0), map(i / 10'000.0)));
    CHECK(largest <= 1);
    for (const double exact : {0.0, 0.25, 0.5, 1.0}) CHECK(colors(exact) == map(exact));
  }
}

TEST_CASE("any function of a share is a color map, and turbo is the default") {
  const color_map steps = [](double share) { return share < 0.5 ? rgb{1, 2, 3} : rgb{4, 5, 6}; };
  CHECK(steps(0.49) == rgb{1, 2, 3});
  CHECK(steps(0.5) == rgb{4, 5, 6});
  const color_map copy = steps;
  CHECK(copy(0.5) == rgb{4, 5, 6});
  CHECK(color_map{}(0.3) == color_map{turbo}(0.3));
  CHECK_FALSE(ColorFunction<int>);
}

TEST_CASE("values beyond the ends have the colours of the ends") {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const color_map colors = viridis;
  for (const double below : {-1e-300, -1.0, -infinity}) CHECK(colors(below) == viridis(0));
  for (const double above : {1 + 1e-15, 7.0, infinity}) CHECK(colors(above) == viridis(1));
}

TEST_CASE("NaN has a colour of its own, which is far from all of a map's and can be chosen") {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  color_map colors;
  CHECK(colors(nan) == colors.unknown);
  for (const auto map : maps)
    for (int i = 0; i <= 1000; ++i)
      REQUIRE((lab(map(i / 1000.0)) - lab(colors.unknown)).norm() > 50);
  colors.unknown = {1, 2, 3};
  CHECK(colors(nan) == rgb{1, 2, 3});
}

TEST_CASE("twenty labels and noise have clearly different colours") {
  for (int a = -1; a < 20; ++a)
    for (int b = a + 1; b < 20; ++b) {
      CAPTURE(a);
      CAPTURE(b);
      CHECK((lab(label_color(a)) - lab(label_color(b))).norm() > 34);
    }
}
