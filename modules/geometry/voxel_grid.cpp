// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
#include "geometry/kernels/voxel_keys.hpp"
module cilantro.geometry;

import :key_sorter;

namespace cilantro {
namespace {

auto copy_from(const std::vector<std::uint64_t>& keys) {
  return [&](index_t begin, index_t end, std::uint64_t* out) {
    std::copy(keys.begin() + begin, keys.begin() + end, out);
  };
}

/// Replaces keys by their rank among the different keys, which needs fewer bits; returns how many.
int compress(std::vector<std::uint64_t>& keys, int bits) {
  std::vector<std::int32_t> indices(keys.size());
  std::iota(indices.begin(), indices.end(), 0);
  const execution how{.threads = 1};
  const auto groups =
      key_sorter<std::uint64_t>{std::ssize(keys), bits, how, copy_from(keys)}.groups(indices, 1);
  for (index_t g = 0; g < groups.size(); ++g)
    for (const auto i : groups[g]) keys[i] = static_cast<std::uint64_t>(g);
  return bit_width(static_cast<std::uint64_t>(groups.size()));
}

/// The range of coordinates along each axis.
template <Scalar S, int D>
struct coordinate_range {
  point_vector<S, D> low, high;
  coordinate_range& operator+=(const coordinate_range& other) {
    low = low.cwiseMin(other.low);
    high = high.cwiseMax(other.high);
    return *this;
  }
  void include(const S* point) {
    for (index_t d = 0; d < low.size(); ++d) {
      low[d] = point[d] < low[d] ? point[d] : low[d];
      high[d] = point[d] > high[d] ? point[d] : high[d];
    }
  }
};

template <Scalar S>
struct voxel_kernels {
  detail::voxel_keys<S>* keys;
  detail::finite_range<S>* range;
};
template <Scalar S>
voxel_kernels<S> key_kernels() {
  return detail::for_target(static_cast<int>(current_vector_target()), []<detail::kernel_target V> {
    return voxel_kernels<S>{detail::voxel_keys_in<V, S>(), detail::finite_range_in<V, S>()};
  });
}

template <Scalar S, int D>
class cell_sorter {
 public:
  cell_sorter(points_view<S, D> points, const cell_layout<D>& layout, const execution& how)
      : points_{points}, layout_{layout}, how_{how} {
    expects(points.size() <= std::numeric_limits<std::int32_t>::max(),
            "voxel_grid: at most 2^31 - 1 points can be sorted into cells");
    find_finite();
  }

  [[nodiscard]] point_groups group(index_t min_points) const {
    const int total = std::accumulate(bits_.begin(), bits_.end(), 0);
    if (is_small(total)) return group_small(total, min_points);
    if (total <= 64) return group_packed(total, min_points);
    return group_wide(min_points);
  }

 private:
  [[nodiscard]] index_t dimension() const { return D == dynamic ? points_.dimension() : D; }
  [[nodiscard]] double quotient(S coordinate, index_t d) const {
    return std::floor((double(coordinate) - layout_.origin[d]) / layout_.edges[d]);
  }
  [[nodiscard]] double quotient(std::int32_t i, index_t d) const {
    return quotient(points_.data()[i * points_.stride() + d], d);
  }
  /// How far along axis d the cell of the i-th finite point is from the first cell.
  [[nodiscard]] std::uint64_t step(index_t i, index_t d) const {
    const auto cell = static_cast<std::int64_t>(quotient(finite_[i], d));
    return static_cast<std::uint64_t>(cell) - static_cast<std::uint64_t>(low_[d]);
  }

  /// The finite points, and the cells that they reach.
  void find_finite() {
    const auto size = static_cast<std::size_t>(dimension());
    low_.resize(size);
    high_.resize(size);
    bits_.resize(size);
    finite_.resize(points_.size());
    struct block {
      std::size_t count = 0;
      coordinate_range<S, D> range;
    };
    const coordinate_range<S, D> none{
        point_vector<S, D>::Constant(dimension(), std::numeric_limits<S>::max()),
        point_vector<S, D>::Constant(dimension(), std::numeric_limits<S>::lowest())};
    std::vector<block> blocks(
        static_cast<std::size_t>((points_.size() + default_block_size - 1) / default_block_size),
        {0, none});
    parallel_blocks(points_.size(), default_block_size, how_,
                    [&](index_t b, index_t begin, index_t end) {
                      block found{0, none};
                      std::int32_t* const out = finite_.data() + begin;
                      if (find_range(begin, end, found.range)) {
                        std::iota(out, out + (end - begin), static_cast<std::int32_t>(begin));
                        blocks[b] = {static_cast<std::size_t>(end - begin), found.range};
                        return;
                      }
                      for (index_t i = begin; i < end; ++i) {
                        const S* const p = points_.data() + i * points_.stride();
                        // What is not finite leaves a difference to itself that is not a number.
                        S difference = 0;
                        for (index_t d = 0; d < dimension(); ++d) difference += p[d] - p[d];
                        if (!(difference == 0)) continue;
                        out[found.count++] = static_cast<std::int32_t>(i);
                        found.range.include(p);
                      }
                      blocks[b] = found;
                    });
    auto range = none;
    std::size_t count = 0;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      const auto first = b * std::size_t{default_block_size};
      if (first != count)
        std::copy_n(finite_.begin() + static_cast<std::ptrdiff_t>(first), blocks[b].count,
                    finite_.begin() + static_cast<std::ptrdiff_t>(count));
      count += blocks[b].count;
      range += blocks[b].range;
    }
    finite_.resize(count);
    if (finite_.empty()) return;
    // Cells ascend with coordinates, so that those of the extremes are the extremes.
    for (std::size_t d = 0; d < size; ++d) {
      const double low = quotient(range.low[index_t(d)], index_t(d)),
                   high = quotient(range.high[index_t(d)], index_t(d));
      if (!(std::abs(low) < cell_limit && std::abs(high) < cell_limit)) refuse();
      low_[d] = static_cast<std::int64_t>(low);
      high_[d] = static_cast<std::int64_t>(high);
      bits_[d] =
          bit_width(static_cast<std::uint64_t>(high_[d]) - static_cast<std::uint64_t>(low_[d]));
    }
  }

  /// False if some of the points are not finite, or there is no kernel for them.
  bool find_range(index_t begin, index_t end, coordinate_range<S, D>& range) const {
    if (dimension() > detail::most_key_axes || points_.stride() != dimension()) return false;
    return key_kernels<S>().range(points_.data() + begin * dimension(),
                                  static_cast<int>(dimension()), end - begin, range.low.data(),
                                  range.high.data());
  }

  [[noreturn]] void refuse() const {
    const auto is_too_far = [&](std::int32_t i) {
      for (index_t d = 0; d < dimension(); ++d)
        if (!(std::abs(quotient(i, d)) < cell_limit)) return true;
      return false;
    };
    throw invalid_input{"voxel_grid: the cell of point " +
                        std::to_string(*std::ranges::find_if(finite_, is_too_far)) +
                        " does not fit 62 bits: choose larger cells, or an origin closer to the "
                        "points"};
  }

  /// Whether the vector kernel can find the keys.
  [[nodiscard]] bool is_small(int total) const {
    constexpr auto most = std::numeric_limits<std::int32_t>::max();
    const auto fits = [](std::int64_t cell) { return -most < cell && cell < most; };
    return total < 32 && dimension() <= detail::most_key_axes && std::ranges::all_of(low_, fits) &&
           std::ranges::all_of(high_, fits);
  }
  [[nodiscard]] point_groups group_small(int total, index_t min_points) const {
    detail::key_layout layout{static_cast<int>(dimension()), {}, {}, {}, {}};
    for (index_t d = 0; d < dimension(); ++d) {
      const auto at = static_cast<std::size_t>(d);
      layout.origin[d] = layout_.origin[d];
      layout.edges[d] = layout_.edges[d];
      layout.low[d] = static_cast<std::int32_t>(low_[at]);
      layout.bits[d] = bits_[at];
    }
    return group_by<std::uint32_t>(
        total, min_points, [&](index_t begin, index_t end, std::uint32_t* out) {
          key_kernels<S>().keys(points_.data(), points_.stride(), finite_.data() + begin,
                                end - begin, layout, out);
        });
  }

  [[nodiscard]] point_groups group_packed(int total, index_t min_points) const {
    return group_by<std::uint64_t>(total, min_points,
                                   [&](index_t begin, index_t end, std::uint64_t* out) {
                                     for (index_t i = begin; i < end; ++i) {
                                       std::uint64_t key = 0;
                                       for (index_t d = 0; d < dimension(); ++d) {
                                         // Shifting by all bits of the key is undefined; then only
                                         // this axis has any.
                                         const int bits = bits_[d];
                                         key = (bits < 64 ? key << bits : 0) | step(i, d);
                                       }
                                       *out++ = key;
                                     }
                                   });
  }

  /// Where the coordinates of a cell have more than 64 bits together, what has been packed so far
  /// is replaced by its rank whenever the next axis would not fit; ranks have at most 31 bits.
  [[nodiscard]] point_groups group_wide(index_t min_points) const {
    std::vector<std::uint64_t> keys(finite_.size(), 0), axis(finite_.size());
    int used = 0;
    for (index_t d = 0; d < dimension(); ++d) {
      for (index_t i = 0; i < std::ssize(finite_); ++i) axis[i] = step(i, d);
      int bits = bits_[d];
      if (used + bits > 64) used = compress(keys, used);
      if (used + bits > 64) bits = compress(axis, bits);
      for (std::size_t i = 0; i < keys.size(); ++i)
        keys[i] = (bits < 64 ? keys[i] << bits : 0) | axis[i];
      used += bits;
    }
    return group_by<std::uint64_t>(used, min_points, copy_from(keys));
  }

  template <class Key, class WriteKeys>
  [[nodiscard]] point_groups group_by(int bits, index_t min_points, WriteKeys write_keys) const {
    return key_sorter<Key>{std::ssize(finite_), bits, how_, write_keys}.groups(finite_, min_points);
  }

  points_view<S, D> points_;
  const cell_layout<D>& layout_;
  const execution& how_;
  buffer<std::int32_t> finite_;
  std::vector<std::int64_t> low_, high_;  ///< The first and the last cell along each axis.
  std::vector<int> bits_;
};

}  // namespace

template <Scalar S, int D>
point_groups closed_voxel_groups(points_view<S, D> points, const cell_layout<D>& layout,
                                 index_t min_points, const execution& how) {
  expect_from(0, double(min_points), "voxel_grid: min_points_per_cell");
  // The range, the keys, two sorts and the groups; fewer where points are few.
  const execution passes{how.threads, in_passes(how.monitor, 5)};
  auto groups = cell_sorter<S, D>{points, layout, passes}.group(min_points);
  if (how.monitor.progress) how.monitor.progress(1);
  return groups;
}

#define CILANTRO_INSTANTIATE(S, D)                                                          \
  template point_groups closed_voxel_groups<S, D>(points_view<S, D>, const cell_layout<D>&, \
                                                  index_t, const execution&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
