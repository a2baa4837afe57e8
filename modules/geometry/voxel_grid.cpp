// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/closed_spaces.hpp"
#include "geometry/voxel_keys.hpp"
module cilantro.geometry;

namespace cilantro {
namespace {

template <class Key>
struct keyed_point {
  Key key;
  std::int32_t index;
};
/// What the kernels write.
template <class Key>
using sorted_point =
    std::conditional_t<std::same_as<Key, std::uint32_t>, detail::keyed_index, keyed_point<Key>>;

/// Sorts by key, keeping the order of equal keys. Only the lowest `bits` of the keys are looked at,
/// in as few rounds as digits that count in a first-level cache allow.
template <class Point>
void radix_sort(buffer<Point>& points, int bits) {
  constexpr int most_digit_bits = 11, most_rounds = 6;
  const int rounds = (bits + most_digit_bits - 1) / most_digit_bits;
  if (rounds == 0) return;
  const int digit_bits = (bits + rounds - 1) / rounds;
  const std::size_t digits = std::size_t{1} << digit_bits;
  const auto digit = [&](const Point& p, int round) {
    return static_cast<std::size_t>(p.key >> (round * digit_bits)) & (digits - 1);
  };
  std::vector<std::uint32_t> places(digits * most_rounds);
  for (const Point& p : points)
    for (int r = 0; r < rounds; ++r) ++places[r * digits + digit(p, r)];
  buffer<Point> other(points.size());
  for (int r = 0; r < rounds; ++r) {
    std::uint32_t* const place = places.data() + r * digits;
    std::exclusive_scan(place, place + digits, place, std::uint32_t{0});
    for (const Point& p : points) other[place[digit(p, r)]++] = p;
    points.swap(other);
  }
}

/// Sorts points by a key of up to 64 bits and cuts them where it changes. `write_keys(begin, end,
/// out)` writes them with their keys.
template <class Key, class WriteKeys>
point_groups group_by(index_t points, int bits, index_t min_points, const execution& how,
                      WriteKeys write_keys) {
  buffer<sorted_point<Key>> sorted(static_cast<std::size_t>(points));
  parallel_blocks(points, default_block_size, how, [&](index_t, index_t begin, index_t end) {
    write_keys(begin, end, sorted.data() + begin);
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
  const auto groups = group_by<std::uint64_t>(
      std::ssize(keys), bits, 1, {.threads = 1}, [&](index_t begin, index_t end, auto* out) {
        for (index_t i = begin; i < end; ++i)
          *out++ = {keys[static_cast<std::size_t>(i)], static_cast<std::int32_t>(i)};
      });
  for (index_t g = 0; g < groups.size(); ++g)
    for (const auto i : groups[g])
      keys[static_cast<std::size_t>(i)] = static_cast<std::uint64_t>(g);
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
detail::voxel_keys<S>& key_kernel() {
#define CILANTRO_ENTRY(target) detail::target::voxel_keys_in<S>(),
  static detail::voxel_keys<S>* const all[] = {CILANTRO_FOR_VECTOR_TARGETS(CILANTRO_ENTRY)};
#undef CILANTRO_ENTRY
  return *all[static_cast<int>(current_vector_target())];
}

template <Scalar S, int D>
class cell_sorter {
 public:
  cell_sorter(points_view<S, D> points, const cell_layout<D>& layout, const execution& how)
      : points_{points}, layout_{layout}, how_{how} {
    expects(points.size() <= std::numeric_limits<std::int32_t>::max(),
            "voxel_grid: at most 2^31 - 1 points can be sorted into cells");
    finite_.resize(static_cast<std::size_t>(points.size()));
    std::size_t count = 0;
    for (index_t i = 0; i < points.size(); ++i) {
      finite_[count] = static_cast<std::int32_t>(i);
      // What is not finite leaves a difference to itself that is not a number.
      const S* const p = points.data() + i * points.stride();
      S difference = 0;
      for (index_t d = 0; d < dimension(); ++d) difference += p[d] - p[d];
      count += difference == 0;
    }
    finite_.resize(count);
    find_range();
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
    const auto cell = static_cast<std::int64_t>(quotient(finite_[static_cast<std::size_t>(i)], d));
    return static_cast<std::uint64_t>(cell) -
           static_cast<std::uint64_t>(low_[static_cast<std::size_t>(d)]);
  }

  void find_range() {
    const auto size = static_cast<std::size_t>(dimension());
    low_.resize(size);
    high_.resize(size);
    bits_.resize(size);
    if (finite_.empty()) return;
    const coordinate_range<S, D> none{
        point_vector<S, D>::Constant(dimension(), std::numeric_limits<S>::max()),
        point_vector<S, D>::Constant(dimension(), std::numeric_limits<S>::lowest())};
    const auto range =
        ordered_sum(std::ssize(finite_), how_, none, [&](coordinate_range<S, D>& r, index_t i) {
          r.include(points_.data() + finite_[static_cast<std::size_t>(i)] * points_.stride());
        });
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
    return group_by<std::uint32_t>(std::ssize(finite_), total, min_points, how_,
                                   [&](index_t begin, index_t end, detail::keyed_index* out) {
                                     key_kernel<S>()(points_.data(), points_.stride(),
                                                     finite_.data() + begin, end - begin, layout,
                                                     out);
                                   });
  }

  [[nodiscard]] point_groups group_packed(int total, index_t min_points) const {
    return group_by<std::uint64_t>(std::ssize(finite_), total, min_points, how_,
                                   [&](index_t begin, index_t end, auto* out) {
                                     for (index_t i = begin; i < end; ++i) {
                                       std::uint64_t key = 0;
                                       for (index_t d = 0; d < dimension(); ++d) {
                                         // Shifting by all bits of the key is undefined; then only
                                         // this axis has any.
                                         const int bits = bits_[static_cast<std::size_t>(d)];
                                         key = (bits < 64 ? key << bits : 0) | step(i, d);
                                       }
                                       *out++ = {key, finite_[static_cast<std::size_t>(i)]};
                                     }
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
    return group_by<std::uint64_t>(
        std::ssize(finite_), used, min_points, how_, [&](index_t begin, index_t end, auto* out) {
          for (index_t i = begin; i < end; ++i)
            *out++ = {keys[static_cast<std::size_t>(i)], finite_[static_cast<std::size_t>(i)]};
        });
  }

  points_view<S, D> points_;
  const cell_layout<D>& layout_;
  const execution& how_;
  buffer<std::int32_t> finite_;
  std::vector<std::int64_t> low_, high_;  ///< The first and the last cell along each axis.
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
      const point_vector<double, D> value = values[i].template cast<double>();
      if (!((value - value).sum() == 0)) continue;
      sum += value;
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
