// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/closed_spaces.hpp"
module cilantro.geometry;

namespace cilantro {
namespace {

template <class Key>
struct keyed_point {
  Key key;
  std::int32_t index;
};

/// Sorts by key, keeping the order of equal keys. Only the lowest `bits` of the keys are looked at.
template <class Key>
void radix_sort(buffer<keyed_point<Key>>& points, int bits) {
  constexpr int digit_bits = 11;
  constexpr std::size_t digits = std::size_t{1} << digit_bits;
  buffer<keyed_point<Key>> other(points.size());
  for (int shift = 0; shift < bits; shift += digit_bits) {
    const auto digit = [shift](const keyed_point<Key>& p) {
      return static_cast<std::size_t>(p.key >> shift) & (digits - 1);
    };
    std::array<std::size_t, digits> place{};
    for (const auto& p : points) ++place[digit(p)];
    std::exclusive_scan(place.begin(), place.end(), place.begin(), std::size_t{0});
    for (const auto& p : points) other[place[digit(p)]++] = p;
    points.swap(other);
  }
}

/// Sorts points by a key of up to 64 bits and cuts them where it changes.
template <class Key, class KeyOf>
point_groups group_by(std::span<const std::int32_t> points, int bits, index_t min_points,
                      const execution& how, KeyOf key_of) {
  buffer<keyed_point<Key>> sorted(points.size());
  parallel_for(std::ssize(points), how, [&](index_t i) {
    const auto at = static_cast<std::size_t>(i);
    sorted[at] = {static_cast<Key>(key_of(i)), points[at]};
  });
  radix_sort(sorted, bits);

  point_groups groups;
  groups.members.resize(sorted.size());
  std::size_t kept = 0;
  for (std::size_t begin = 0, end; begin < sorted.size(); begin = end) {
    for (end = begin; end < sorted.size() && sorted[end].key == sorted[begin].key; ++end) {
    }
    if (std::cmp_less(end - begin, min_points)) continue;
    for (std::size_t i = begin; i < end; ++i) groups.members[kept++] = sorted[i].index;
    groups.offsets.push_back(static_cast<index_t>(kept));
  }
  groups.members.resize(kept);
  return groups;
}

/// The standard's returns int, or, in some libraries, the type of its argument.
int bit_width(std::uint64_t value) {
  return static_cast<int>(std::bit_width(value));
}

/// Replaces keys by their rank among the different keys, which needs fewer bits; returns how many.
int compress(std::vector<std::uint64_t>& keys, int bits) {
  std::vector<std::int32_t> all(keys.size());
  std::iota(all.begin(), all.end(), 0);
  const auto groups = group_by<std::uint64_t>(
      all, bits, 1, {.threads = 1}, [&](index_t i) { return keys[static_cast<std::size_t>(i)]; });
  for (index_t g = 0; g < groups.size(); ++g)
    for (const auto i : groups[g])
      keys[static_cast<std::size_t>(i)] = static_cast<std::uint64_t>(g);
  return bit_width(static_cast<std::uint64_t>(groups.size()));
}

/// The range of cells along each axis, and where the first point is that has no cell.
struct cell_range {
  std::vector<std::int64_t> low, high;
  index_t too_far = std::numeric_limits<index_t>::max();
  cell_range& operator+=(const cell_range& other) {
    for (std::size_t d = 0; d < low.size(); ++d) {
      low[d] = std::min(low[d], other.low[d]);
      high[d] = std::max(high[d], other.high[d]);
    }
    too_far = std::min(too_far, other.too_far);
    return *this;
  }
};

template <Scalar S, int D>
class cell_sorter {
 public:
  cell_sorter(points_view<S, D> points, const cell_layout<D>& layout, const execution& how)
      : points_{points}, layout_{layout}, how_{how} {
    expects(points.size() <= std::numeric_limits<std::int32_t>::max(),
            "voxel_grid: at most 2^31 - 1 points can be sorted into cells");
    finite_.reserve(static_cast<std::size_t>(points.size()));
    for (index_t i = 0; i < points.size(); ++i)
      if (is_finite(points[i])) finite_.push_back(static_cast<std::int32_t>(i));
    find_range();
  }

  [[nodiscard]] point_groups group(index_t min_points) const {
    const int total = std::accumulate(bits_.begin(), bits_.end(), 0);
    if (total <= 32) return group_packed<std::uint32_t>(total, min_points);
    if (total <= 64) return group_packed<std::uint64_t>(total, min_points);
    return group_wide(min_points);
  }

 private:
  [[nodiscard]] index_t dimension() const { return D == dynamic ? points_.dimension() : D; }
  [[nodiscard]] double quotient(index_t i, index_t d) const {
    return std::floor((double(points_.data()[i * points_.stride() + d]) - layout_.origin[d]) /
                      layout_.edges[d]);
  }
  /// How far along axis d the cell of the i-th finite point is from the first cell.
  [[nodiscard]] std::uint64_t step(index_t i, index_t d) const {
    const auto cell = static_cast<std::int64_t>(quotient(finite_[static_cast<std::size_t>(i)], d));
    return static_cast<std::uint64_t>(cell) -
           static_cast<std::uint64_t>(low_[static_cast<std::size_t>(d)]);
  }

  void find_range() {
    const auto size = static_cast<std::size_t>(dimension());
    const cell_range none{
        std::vector<std::int64_t>(size, std::numeric_limits<std::int64_t>::max()),
        std::vector<std::int64_t>(size, std::numeric_limits<std::int64_t>::min())};
    const auto range = ordered_sum(std::ssize(finite_), how_, none, [&](cell_range& r, index_t i) {
      const index_t point = finite_[static_cast<std::size_t>(i)];
      for (index_t d = 0; d < dimension(); ++d) {
        const double q = quotient(point, d);
        if (!(std::abs(q) < cell_limit)) {
          r.too_far = std::min(r.too_far, point);
          return;
        }
        const auto at = static_cast<std::size_t>(d);
        r.low[at] = std::min(r.low[at], static_cast<std::int64_t>(q));
        r.high[at] = std::max(r.high[at], static_cast<std::int64_t>(q));
      }
    });
    if (range.too_far != none.too_far)
      throw invalid_input{"voxel_grid: the cell of point " + std::to_string(range.too_far) +
                          " does not fit 62 bits: choose larger cells, or an origin closer to the "
                          "points"};
    low_ = range.low;
    for (std::size_t d = 0; d < size; ++d)
      bits_.push_back(finite_.empty() ? 0
                                      : bit_width(static_cast<std::uint64_t>(range.high[d]) -
                                                  static_cast<std::uint64_t>(range.low[d])));
  }

  template <class Key>
  [[nodiscard]] point_groups group_packed(int total, index_t min_points) const {
    return group_by<Key>(finite_, total, min_points, how_, [&](index_t i) {
      Key key = 0;
      for (index_t d = 0; d < dimension(); ++d) {
        // Shifting by all bits of the key is undefined; then only this axis has any.
        const int bits = bits_[static_cast<std::size_t>(d)];
        key = (bits < std::numeric_limits<Key>::digits ? static_cast<Key>(key << bits) : Key{0}) |
              static_cast<Key>(step(i, d));
      }
      return key;
    });
  }

  /// Where the coordinates of a cell have more than 64 bits together, what has been packed so far
  /// is replaced by its rank whenever the next axis would not fit; ranks have at most 31 bits.
  [[nodiscard]] point_groups group_wide(index_t min_points) const {
    std::vector<std::uint64_t> keys(finite_.size(), 0), axis(finite_.size());
    int used = 0;
    for (index_t d = 0; d < dimension(); ++d) {
      for (index_t i = 0; i < std::ssize(finite_); ++i)
        axis[static_cast<std::size_t>(i)] = step(i, d);
      int bits = bits_[static_cast<std::size_t>(d)];
      if (used + bits > 64) used = compress(keys, used);
      if (used + bits > 64) bits = compress(axis, bits);
      for (std::size_t i = 0; i < keys.size(); ++i)
        keys[i] = (bits < 64 ? keys[i] << bits : 0) | axis[i];
      used += bits;
    }
    return group_by<std::uint64_t>(finite_, used, min_points, how_,
                                   [&](index_t i) { return keys[static_cast<std::size_t>(i)]; });
  }

  points_view<S, D> points_;
  const cell_layout<D>& layout_;
  const execution& how_;
  std::vector<std::int32_t> finite_;
  std::vector<std::int64_t> low_;
  std::vector<int> bits_;
};

void expect_members(const point_groups& groups, index_t size) {
  expects(std::ranges::all_of(groups.members, [&](std::int32_t i) { return 0 <= i && i < size; }),
          "groups: a member is not one of the points");
}

/// Groups handed to a thread at a time.
constexpr index_t group_block_size = 512;

template <Scalar S, int D, class Reduce>
point_matrix<S, D> per_group(points_view<S, D> values, const point_groups& groups,
                             const execution& how, Reduce reduce) {
  expect_members(groups, values.size());
  point_matrix<S, D> result(values.dimension(), groups.size());
  parallel_blocks(groups.size(), group_block_size, how, [&](index_t, index_t begin, index_t end) {
    point_vector<double, D> sum(values.dimension());
    for (index_t g = begin; g < end; ++g) {
      reduce(groups[g], sum);
      result.col(g) = sum.template cast<S>();
    }
  });
  return result;
}

}  // namespace

template <Scalar S, int D>
point_groups closed_voxel_groups(points_view<S, D> points, const cell_layout<D>& layout,
                                 index_t min_points, const execution& how) {
  expects(min_points >= 0, "voxel_grid: min_points must not be negative");
  return cell_sorter<S, D>{points, layout, how}.group(min_points);
}

template <Scalar S, int D>
point_matrix<S, D> closed_group_means(points_view<S, D> values, const point_groups& groups,
                                      const execution& how) {
  return per_group(values, groups, how, [&](auto members, point_vector<double, D>& sum) {
    sum.setZero();
    index_t count = 0;
    for (const auto i : members) {
      const auto value = values[i];
      if (!is_finite(value)) continue;
      sum += value.template cast<double>();
      ++count;
    }
    sum /= double(count);
  });
}

template <Scalar S, int D>
point_matrix<S, D> closed_group_directions(points_view<S, D> directions, const point_groups& groups,
                                           const execution& how) {
  return per_group(directions, groups, how, [&](auto members, point_vector<double, D>& sum) {
    sum.setZero();
    index_t first = -1;
    for (const auto i : members) {
      const auto direction = directions[i];
      if (!is_finite(direction) || direction.isZero(0)) continue;
      if (first < 0) first = i;
      if (direction.dot(directions[first]) < 0)
        sum -= direction.template cast<double>();
      else
        sum += direction.template cast<double>();
    }
    const double length = sum.norm();
    // Unit vectors that cancel leave their rounding behind, which is no direction.
    if (length > 1e-6)
      sum /= length;
    else
      sum.setZero();
  });
}

#define CILANTRO_INSTANTIATE(S, D)                                                             \
  template point_groups closed_voxel_groups<S, D>(points_view<S, D>, const cell_layout<D>&,    \
                                                  index_t, const execution&);                  \
  template point_matrix<S, D> closed_group_means<S, D>(points_view<S, D>, const point_groups&, \
                                                       const execution&);                      \
  template point_matrix<S, D> closed_group_directions<S, D>(                                   \
      points_view<S, D>, const point_groups&, const execution&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
