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
#include "geometry/group_means.hpp"
#include "geometry/voxel_keys.hpp"
module cilantro.geometry;

namespace cilantro {
namespace {

/// The standard's returns int, or, in some libraries, the type of its argument.
int bit_width(std::uint64_t value) {
  return static_cast<int>(std::bit_width(value));
}

/// Consecutive points of one key, which are sorted as one: scans come row by row, so that there are
/// about half as many of these as points.
template <class Key>
struct key_run {
  Key key;
  std::int32_t begin, size;
};

/// Sorts by the lowest `bits` of the keys, keeping the order of equal keys, with `other` as room;
/// where the result is: in `other` or not.
template <class Run>
bool radix_sort(std::span<Run> runs, std::span<Run> other, int bits) {
  constexpr int most_digit_bits = 11;
  const int rounds = (bits + most_digit_bits - 1) / most_digit_bits;
  if (rounds == 0) return false;
  const int digit_bits = (bits + rounds - 1) / rounds;
  const std::size_t digits = std::size_t{1} << digit_bits;
  if (runs.size() < digits / 16) {
    std::ranges::sort(runs, {}, [](const Run& run) { return std::pair{run.key, run.begin}; });
    return false;
  }
  const auto digit = [&](const Run& run, int round) {
    return static_cast<std::size_t>(run.key >> (round * digit_bits)) & (digits - 1);
  };
  std::vector<std::uint32_t> places(digits * static_cast<std::size_t>(rounds));
  for (const Run& run : runs)
    for (int r = 0; r < rounds; ++r) ++places[static_cast<std::size_t>(r) * digits + digit(run, r)];
  for (int r = 0; r < rounds; ++r) {
    std::uint32_t* const place = places.data() + static_cast<std::size_t>(r) * digits;
    std::exclusive_scan(place, place + digits, place, std::uint32_t{0});
    for (const Run& run : runs) other[place[digit(run, r)]++] = run;
    std::swap(runs, other);
  }
  return rounds % 2 != 0;
}

/// Sorts points into groups by a key of up to 64 bits, of which the lowest `bits` are used.
///
/// The highest bits cut the work into parts, which are sorted apart: by several threads, and in the
/// cache of each.
template <class Key>
class key_sorter {
 public:
  /// `write_keys(begin, end, out)` writes the keys of some consecutive points.
  template <class WriteKeys>
  key_sorter(index_t points, int bits, const execution& how, WriteKeys write_keys) : how_{how} {
    find_runs(points, write_keys);
    cut(bits);
  }

  /// `indices` names the points, ascending, and so do those of a group.
  [[nodiscard]] point_groups groups(std::span<const std::int32_t> indices,
                                    index_t min_points) const {
    const std::size_t parts = parts_.size() - 1;
    std::vector<std::size_t> groups(parts + 1), members(parts + 1);
    for_each_part([&](std::size_t part) {
      for (std::size_t r = parts_[part]; r < parts_[part + 1]; ++r) {
        groups[part + 1] += is_last_of_group(part, r);
        members[part + 1] += static_cast<std::size_t>(runs_[r].size);
      }
    });
    std::partial_sum(groups.begin(), groups.end(), groups.begin());
    std::partial_sum(members.begin(), members.end(), members.begin());
    point_groups found;
    found.offsets.resize(groups.back() + 1);
    found.members.resize(members.back());
    // Where none is missing, a place in the list is the point.
    const bool are_all = indices.empty() || std::cmp_equal(indices.back() + 1, indices.size());
    for_each_part([&](std::size_t part) {
      index_t* group = found.offsets.data() + groups[part] + 1;
      std::int32_t* out = found.members.data() + members[part];
      const std::int32_t* const end = found.members.data() + members[part + 1];
      for (std::size_t r = parts_[part]; r < parts_[part + 1]; ++r) {
        if (are_all)
          count_from(runs_[r], out, end);
        else
          std::copy_n(indices.data() + runs_[r].begin, runs_[r].size, out);
        out += runs_[r].size;
        *group = out - found.members.data();
        group += is_last_of_group(part, r);
      }
    });
    if (min_points > 1) leave_out_small(found, min_points);
    return found;
  }

 private:
  [[nodiscard]] bool is_last_of_group(std::size_t part, std::size_t r) const {
    return r + 1 == parts_[part + 1] || runs_[r + 1].key != runs_[r].key;
  }

  /// Most runs are short, but nobody can foresee how short: more is written than needed if there is
  /// room for it, and overwritten by the next one.
  static void count_from(const key_run<Key>& run, std::int32_t* out, const std::int32_t* end) {
    constexpr std::int32_t most = 8;
    const std::int32_t size = run.size <= most && end - out >= most ? most : run.size;
    for (std::int32_t i = 0; i < size; ++i) out[i] = run.begin + i;
  }

  static void leave_out_small(point_groups& groups, index_t min_points) {
    std::size_t kept = 0;
    index_t members = 0;
    for (index_t g = 0; g < groups.size(); ++g) {
      const auto all = groups[g];
      if (std::ssize(all) < min_points) continue;
      std::ranges::copy(all, groups.members.begin() + members);
      members += std::ssize(all);
      // What is overwritten has been looked at.
      groups.offsets[++kept] = members;
    }
    groups.offsets.resize(kept + 1);
    groups.members.resize(static_cast<std::size_t>(members));
  }

  template <class WriteKeys>
  void find_runs(index_t points, WriteKeys write_keys) {
    const auto blocks = (points + default_block_size - 1) / default_block_size;
    std::vector<std::size_t> count(static_cast<std::size_t>(blocks));
    runs_.resize(static_cast<std::size_t>(points));
    parallel_blocks(points, default_block_size, how_, [&](index_t b, index_t begin, index_t end) {
      std::array<Key, default_block_size> keys;
      write_keys(begin, end, keys.data());
      // Without a branch: where a run ends is nothing that a processor could foresee.
      key_run<Key>* const out = runs_.data() + begin;
      std::size_t last = 0;
      for (index_t i = 0; i < end - begin; ++i) {
        const Key key = keys[static_cast<std::size_t>(i)];
        last += key != keys[static_cast<std::size_t>(std::max<index_t>(i, 1) - 1)];
        out[last] = {key, static_cast<std::int32_t>(begin + i + 1), 0};  // Where it ends so far.
      }
      count[static_cast<std::size_t>(b)] = last + 1;
    });
    std::size_t total = 0;
    for (const std::size_t some : count) total += some;
    key_run<Key>* out = runs_.data();
    std::int32_t begin = 0;
    for (std::size_t b = 0; b < count.size(); ++b) {
      const key_run<Key>* from = runs_.data() + b * std::size_t{default_block_size};
      for (std::size_t k = 0; k < count[b]; ++k) {
        const auto [key, end, unused] = from[k];
        *out++ = {key, begin, end - begin};
        begin = end;
      }
    }
    runs_.resize(total);
  }

  /// A part is of about a thousand runs where keys are spread evenly.
  void cut(int bits) {
    constexpr int most_part_bits = 10, run_bits = 10;
    const int part_bits =
        std::clamp(bit_width(runs_.size()) - run_bits, 0, std::min(bits, most_part_bits));
    const int rest = bits - part_bits;
    parts_.assign((std::size_t{1} << part_bits) + 1, 0);
    buffer<key_run<Key>> other(runs_.size());
    const auto part_of = [&](const key_run<Key>& run) {
      return part_bits == 0 ? 0 : static_cast<std::size_t>(run.key >> rest);
    };
    for (const auto& run : runs_) ++parts_[part_of(run) + 1];
    for (std::size_t p = 1; p < parts_.size(); ++p) parts_[p] += parts_[p - 1];
    std::vector<std::size_t> place{parts_.begin(), parts_.end() - 1};
    for (const auto& run : runs_) other[place[part_of(run)]++] = run;
    for_each_part([&](std::size_t part) {
      const auto size = parts_[part + 1] - parts_[part];
      const auto runs = std::span{runs_}.subspan(parts_[part], size);
      const auto sorted = std::span{other}.subspan(parts_[part], size);
      if (!radix_sort(sorted, runs, rest)) std::ranges::copy(sorted, runs.begin());
    });
  }

  template <class F>
  void for_each_part(F f) const {
    // Few at a time: some hold far more than others.
    parallel_blocks(std::ssize(parts_) - 1, 4, how_, [&](index_t, index_t begin, index_t end) {
      for (index_t part = begin; part < end; ++part) f(static_cast<std::size_t>(part));
    });
  }
  const execution& how_;
  buffer<key_run<Key>> runs_;
  std::vector<std::size_t> parts_;  ///< Where each part begins, and where the last ends.
};

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
struct voxel_kernels {
  detail::voxel_keys<S>* keys;
  detail::finite_range<S>* range;
};
template <Scalar S>
const voxel_kernels<S>& key_kernels() {
#define CILANTRO_ENTRY(target) \
  {detail::target::voxel_keys_in<S>(), detail::target::finite_range_in<S>()},
  static const voxel_kernels<S> all[] = {CILANTRO_FOR_VECTOR_TARGETS(CILANTRO_ENTRY)};
#undef CILANTRO_ENTRY
  return all[static_cast<int>(current_vector_target())];
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
    const auto cell = static_cast<std::int64_t>(quotient(finite_[static_cast<std::size_t>(i)], d));
    return static_cast<std::uint64_t>(cell) -
           static_cast<std::uint64_t>(low_[static_cast<std::size_t>(d)]);
  }

  /// The finite points, and the cells that they reach.
  void find_finite() {
    const auto size = static_cast<std::size_t>(dimension());
    low_.resize(size);
    high_.resize(size);
    bits_.resize(size);
    finite_.resize(static_cast<std::size_t>(points_.size()));
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
                        blocks[static_cast<std::size_t>(b)] = {
                            static_cast<std::size_t>(end - begin), found.range};
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
                      blocks[static_cast<std::size_t>(b)] = found;
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
                                         const int bits = bits_[static_cast<std::size_t>(d)];
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
      for (index_t i = 0; i < std::ssize(finite_); ++i)
        axis[static_cast<std::size_t>(i)] = step(i, d);
      int bits = bits_[static_cast<std::size_t>(d)];
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

void expect_members(const point_groups& groups, index_t size) {
  expects(std::ranges::all_of(groups.members, [&](std::int32_t i) { return 0 <= i && i < size; }),
          "groups: a member is not one of the points");
}

/// Groups handed to a thread at a time.
constexpr index_t group_block_size = 512;

template <Scalar S, int D>
detail::group_means<S>& means_kernel() {
#define CILANTRO_ENTRY(target) detail::target::group_means_in<S, D>(),
  static detail::group_means<S>* const all[] = {CILANTRO_FOR_VECTOR_TARGETS(CILANTRO_ENTRY)};
#undef CILANTRO_ENTRY
  return *all[static_cast<int>(current_vector_target())];
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
  expect_members(groups, values.size());
  point_matrix<S, D> means(values.dimension(), groups.size());
  const auto mean_of_finite = [&](index_t g) {
    point_vector<double, D> sum = point_vector<double, D>::Zero(values.dimension());
    index_t count = 0;
    for (const auto i : groups[g]) {
      if (!is_finite(values[i])) continue;
      sum += values[i].template cast<double>();
      ++count;
    }
    means.col(g) = (sum / double(count)).template cast<S>();
  };
  parallel_blocks(groups.size(), group_block_size, how, [&](index_t, index_t begin, index_t end) {
    for (index_t g = begin; g < end; ++g) {
      if constexpr (D == 2 || D == 3) {
        g += means_kernel<S, D>()({values.data(), values.stride(), values.size(),
                                   groups.members.data(), groups.offsets.data()},
                                  g, end - g, means.data() + g * D);
        if (g == end) return;
      }
      mean_of_finite(g);
    }
  });
  return means;
}

template <Scalar S, int D>
point_matrix<S, D> closed_group_directions(points_view<S, D> directions, const point_groups& groups,
                                           const execution& how) {
  expect_members(groups, directions.size());
  point_matrix<S, D> means(directions.dimension(), groups.size());
  const auto mean_of = [&](index_t g) -> point_vector<double, D> {
    point_vector<double, D> sum = point_vector<double, D>::Zero(directions.dimension());
    index_t first = -1;
    for (const auto i : groups[g]) {
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
    if (length > 1e-6) return sum / length;
    return point_vector<double, D>::Zero(sum.size());
  };
  parallel_blocks(groups.size(), group_block_size, how, [&](index_t, index_t begin, index_t end) {
    for (index_t g = begin; g < end; ++g) means.col(g) = mean_of(g).template cast<S>();
  });
  return means;
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
