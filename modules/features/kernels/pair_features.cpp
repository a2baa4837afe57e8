// SPDX-License-Identifier: MIT
#include "features/kernels/pair_features.hpp"

#include "core/vectors.hpp"

namespace cilantro::detail::CILANTRO_VECTOR_TARGET {
namespace {

using lanes = vec<float, width>;
using whole = vec<std::int32_t, width>;
using direction = triple<lanes>;

/// The bin of a value from −1 to 1.
CILANTRO_ALWAYS_INLINE whole bin_of(lanes value) {
  const whole bin = convert<whole>((value + 1) * (0.5F * histogram_bins));
  return smaller(larger(bin, whole(0)), whole(histogram_bins - 1));
}

/// cos and sin of the borders of bins of an angle, π/11 times 1, 3, 5, 7 and 9.
constexpr float border_cosines[] = {0.959492974F, 0.654860734F, 0.142314838F, -0.415415013F,
                                    -0.841253533F};
constexpr float border_sines[] = {0.281732557F, 0.755749574F, 0.989821442F, 0.909631995F,
                                  0.540640817F};

/// The bin of the angle from the x axis to (x, y), from −π to π: how many borders are passed.
CILANTRO_ALWAYS_INLINE whole angle_bin(lanes x, lanes y) {
  const lanes height = magnitude(y);
  whole passed = 0;
  for (int i = 0; i < histogram_bins / 2; ++i)
    passed -= height * border_cosines[i] - x * border_sines[i] >= 0;
  return histogram_bins / 2 + (y < 0 ? -passed : passed);
}

void count_pairs(const surface_point* all, const surface_point& center, const std::int32_t* near,
                 std::ptrdiff_t count, bool oriented, std::int32_t* counts) {
  const direction here{lanes(center.point[0]), lanes(center.point[1]), lanes(center.point[2])};
  const direction normal{lanes(center.normal[0]), lanes(center.normal[1]), lanes(center.normal[2])};
  for (std::ptrdiff_t begin = 0; begin < count; begin += width) {
    const auto some = static_cast<int>(count - begin < width ? count - begin : width);
    float gathered[6][width];
    for (int i = 0; i < width; ++i) {
      // Lanes beyond the last neighbour hold the centre, which forms no pair with itself.
      const surface_point& one = i < some ? all[near[begin + i]] : center;
      for (int d = 0; d < 3; ++d) {
        gathered[d][i] = one.point[d];
        gathered[3 + d][i] = one.normal[d];
      }
    }
    const direction there{load<lanes>(gathered[0]), load<lanes>(gathered[1]),
                          load<lanes>(gathered[2])};
    direction other{load<lanes>(gathered[3]), load<lanes>(gathered[4]), load<lanes>(gathered[5])};
    if (!oriented) other = choose(dot(normal, other) < 0, other * lanes(-1), other);

    direction way = there - here;
    const lanes square = dot(way, way);
    way = way * (1 / __builtin_elementwise_sqrt(square));
    // The pair is seen from the end whose normal is closer to the line between them.
    const lanes from_here = dot(normal, way), from_there = dot(other, way);
    const whole turned = magnitude(from_here) < magnitude(from_there);
    const direction u = choose(turned, other, normal), o = choose(turned, normal, other);
    way = choose(turned, way * lanes(-1), way);
    const lanes phi = turned ? -from_there : from_here;

    direction v = cross(way, u);
    const lanes slant = dot(v, v);
    v = v * (1 / __builtin_elementwise_sqrt(slant));
    const direction w = cross(u, v);
    // Comparisons with NaN, where points or directions coincide, are false.
    const whole counts_in = (square > 0) & (slant > 1e-12F) & (dot(other, other) > 0.5F);
    std::int32_t bins[3][width];
    store(bins[0], angle_bin(dot(u, o), dot(w, o)));
    store(bins[1], bin_of(dot(v, o)));
    store(bins[2], bin_of(phi));
    const unsigned valid = bits(counts_in);
    for (int i = 0; i < some; ++i) {
      if (!(valid >> i & 1)) continue;
      ++counts[bins[0][i]];
      ++counts[histogram_bins + bins[1][i]];
      ++counts[2 * histogram_bins + bins[2][i]];
    }
  }
}

using four = vec<float, 4>;
constexpr int parts = histogram_stride / 4;

void blend(const float* histograms, const std::int32_t* near, const float* weights,
           const std::uint8_t* mirrored, std::ptrdiff_t count, float* sum) {
  // Summed apart, so that mirroring is done once.
  four sums[2][parts] = {};
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    const float* one = histograms + std::ptrdiff_t(near[i]) * histogram_stride;
    four* to = sums[mirrored[i] ? 1 : 0];
    const four weight = weights[i];
    for (int p = 0; p < parts; ++p) to[p] += weight * load<four>(one + 4 * p);
  }
  float plain[2][histogram_stride];
  for (int m = 0; m < 2; ++m)
    for (int p = 0; p < parts; ++p) store(plain[m] + 4 * p, sums[m][p]);
  for (int b = 0; b < histogram_bins; ++b) {
    const int last = histogram_bins - 1;
    sum[b] += plain[0][b] + plain[1][last - b];
    sum[histogram_bins + b] += plain[0][histogram_bins + b] + plain[1][histogram_bins + b];
    sum[2 * histogram_bins + b] +=
        plain[0][2 * histogram_bins + b] + plain[1][2 * histogram_bins + last - b];
  }
}

}  // namespace
}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET

namespace cilantro::detail {

using namespace CILANTRO_VECTOR_TARGET;

template <kernel_target V>
const pair_features& pair_features_in() {
  static constexpr pair_features functions{count_pairs, blend};
  return functions;
}
template const pair_features& pair_features_in<this_target>();

}  // namespace cilantro::detail
