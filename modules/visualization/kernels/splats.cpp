// SPDX-License-Identifier: MIT
#include "visualization/kernels/splats.hpp"

#include "core/vectors.hpp"

namespace cilantro::detail::CILANTRO_VECTOR_TARGET {
namespace {

using floats = vec<float, width>;
using integers = vec<std::int32_t, width>;

constexpr integers lanes = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};

template <int Columns, bool Orthographic>
CILANTRO_ALWAYS_INLINE unsigned cover(const disc_shape& disc, const pixel_grid& grid,
                                      const pixel_block& block, covered_block& out) {
  const integers column = block.x + lanes % Columns, row = block.y + lanes / Columns;
  const auto *n = disc.normal, *m = disc.middle;
  const floats x = convert<floats>(column), y = convert<floats>(row);
  const floats u = (x - grid.cx) / grid.fx, v = (y - grid.cy) / grid.fy;
  floats a = u, b = v, z;
  if constexpr (Orthographic) {
    z = (disc.along - n[0] * u - n[1] * v) / n[2];
  } else {
    z = disc.along / (n[0] * u + (n[1] * v + n[2]));
    a *= z;
    b *= z;
  }
  a -= m[0];
  b -= m[1];
  const floats c = z - m[2], dx = x - disc.x, dy = y - disc.y;
  const floats share = (a * a + (b * b + c * c)) / disc.square;
  const auto is_inside = share <= 1;
  const floats shares = is_inside ? share : 4 * (dx * dx + dy * dy);
  store(out.shares, shares);
  store(out.depths, is_inside ? z : floats(m[2]));
  return bits((shares <= 1) & (column <= block.last_x) & (row <= block.last_y));
}

template <int Columns>
CILANTRO_ALWAYS_INLINE unsigned cover(const disc_shape& disc, const pixel_grid& grid,
                                      const pixel_block& block, covered_block& out) {
  return grid.orthographic ? cover<Columns, true>(disc, grid, block, out)
                           : cover<Columns, false>(disc, grid, block, out);
}

unsigned cover_disc(const disc_shape& disc, const pixel_grid& grid, const pixel_block& block,
                    covered_block& out) {
  switch (block.columns) {
    case 4:
      return cover<4>(disc, grid, block, out);
    case 8:
      return cover<8>(disc, grid, block, out);
    default:
      return cover<16>(disc, grid, block, out);
  }
}

/// As those of the C library: of numbers that an integer can hold.
CILANTRO_ALWAYS_INLINE integers floor_of(floats x) {
  const integers whole = convert<integers>(x);
  return whole + (convert<floats>(whole) > x);  // A comparison that holds is -1.
}
CILANTRO_ALWAYS_INLINE integers ceil_of(floats x) {
  const integers whole = convert<integers>(x);
  return whole - (convert<floats>(whole) < x);
}

/// So many keys are in a register.
constexpr int at_once = this_target == kernel_target::avx512 ? 8 : 4;

/// Pixels from `first` to `last`.
CILANTRO_ALWAYS_INLINE void keep_least(std::int64_t* row, int first, int last, std::int64_t key) {
  if constexpr (this_target == kernel_target::baseline) {
    for (int x = first; x <= last; ++x) row[x] = smaller(key, row[x]);
  } else {
    using keys = vec<std::int64_t, at_once>;
    constexpr std::int64_t steps[] = {0, 1, 2, 3, 4, 5, 6, 7};
    const auto step = load<keys>(steps);
    for (int x = first; x <= last; x += at_once) {
      const auto before = load<keys>(row + x);
      const auto is_nearer = (before > key) & (step <= last - x);
      store(row + x, is_nearer ? keys(key) : before);
    }
  }
}

/// Calls `f(y, first, last)` for the rows of a splat.
template <class F>
CILANTRO_ALWAYS_INLINE void for_rows(const round_splat& s, const pixel_grid& grid, F f) {
  const float square = s.radius * s.radius;
  for (int y = s.first_row; y <= s.last_row; y += width) {
    const floats dy = convert<floats>(y + lanes) - s.y, rest = square - dy * dy;
    const floats half = __builtin_elementwise_sqrt(larger(rest, floats(0)));
    alignas(64) std::int32_t first[width], last[width];
    store(first, larger(ceil_of(s.x - half), integers(0)));
    store(last, smaller(floor_of(s.x + half), integers(grid.width - 1)));
    for (int i = 0; i < smaller(s.last_row - y + 1, width); ++i) f(y + i, first[i], last[i]);
  }
}

void keep_least_in_round(const round_splat& s, std::int64_t key, const pixel_grid& grid,
                         std::int64_t* pixels) {
  for_rows(s, grid, [&](int y, int first, int last) {
    keep_least(pixels + static_cast<std::ptrdiff_t>(y) * grid.width, first, last, key);
  });
}

void mix(const mixed_splat& splat, const std::int64_t* nearest, const pixel_grid& grid,
         color_sum* sums) {
  // Four pixels at once, whose sums are four numbers each.
  using four_floats = vec<float, 4>;
  using four_integers = vec<std::int32_t, 4>;
  using parts = vec<std::uint32_t, 16>;
  const auto& s = splat.round;
  const float inverse = 1 / (s.radius * s.radius);
  const std::uint64_t rg = splat.own.red_green, bw = splat.own.blue_weight;
  const auto own = __builtin_bit_cast(parts, vec<std::uint64_t, 8>{rg, bw, rg, bw, rg, bw, rg, bw});
  const four_integers step = lanes.lo.lo;
  for_rows(s, grid, [&](int y, int first, int last) {
    const auto row = static_cast<std::ptrdiff_t>(y) * grid.width;
    const float dy = static_cast<float>(y) - s.y;
    for (int x = first; x <= last; x += 4) {
      const auto keys = load<vec<std::int64_t, 4>>(nearest + row + x);
      const auto depths = __builtin_bit_cast(four_floats, convert<four_integers>(keys >> 32));
      const auto numbers = convert<vec<std::uint32_t, 4>>(keys);
      const four_integers counts =
          (numbers < splat.points) & ~(splat.z - depths > splat.diameter) & (step <= last - x);
      if (!__builtin_reduce_or(counts)) continue;
      const four_floats dx = convert<four_floats>(x + step) - s.x;
      const four_floats share = smaller((dx * dx + dy * dy) * inverse, four_floats(1));
      const four_floats weight = 1 + static_cast<float>(splat.most_weight - 1) * (1 - share);
      const auto counted =
          __builtin_bit_cast(vec<std::uint32_t, 4>, convert<four_integers>(weight) & counts);
      const parts each =
          __builtin_shufflevector(counted, counted, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
      store(sums + row + x, load<parts>(sums + row + x) + own * each);
    }
  });
}

}  // namespace
}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET

namespace cilantro::detail {

using namespace CILANTRO_VECTOR_TARGET;

template <kernel_target V>
splat_kernels splat_kernels_in() {
  return {cover_disc, keep_least_in_round, mix};
}
template splat_kernels splat_kernels_in<this_target>();

}  // namespace cilantro::detail
