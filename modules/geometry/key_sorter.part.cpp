// SPDX-License-Identifier: MIT
//
// Points sorted by a key, as the cells of a grid are. Internal.
module cilantro.geometry:key_sorter;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :groups;
import :voxel_grid;

namespace cilantro {

/// The standard's returns int, or, in some libraries, the type of its argument.
inline int bit_width(std::uint64_t value) {
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
    groups.members.resize(members);
  }

  /// Runs of a block of points end with it. They are kept where its points are, and so far say
  /// where they end instead of where they begin.
  template <class WriteKeys>
  void find_runs(index_t points, WriteKeys write_keys) {
    count_.resize(static_cast<std::size_t>((points + default_block_size - 1) / default_block_size));
    room_ = std::make_unique_for_overwrite<key_run<Key>[]>(static_cast<std::size_t>(points));
    runs_ = {room_.get(), static_cast<std::size_t>(points)};
    parallel_blocks(points, default_block_size, how_, [&](index_t b, index_t begin, index_t end) {
      std::array<Key, default_block_size> keys;
      write_keys(begin, end, keys.data());
      // Without a branch: where a run ends is nothing that a processor could foresee.
      key_run<Key>* const out = runs_.data() + begin;
      std::size_t last = 0;
      for (index_t i = 0; i < end - begin; ++i) {
        const Key key = keys[i];
        last += key != keys[std::max<index_t>(i, 1) - 1];
        out[last] = {key, static_cast<std::int32_t>(begin + i + 1), 0};  // Where it ends so far.
      }
      count_[b] = last + 1;
    });
  }

  /// A part is of about a thousand runs where keys are spread evenly.
  void cut(int bits) {
    constexpr int most_part_bits = 10, run_bits = 10;
    const auto total = std::accumulate(count_.begin(), count_.end(), std::size_t{0});
    const int part_bits =
        std::clamp(bit_width(total) - run_bits, 0, std::min(bits, most_part_bits));
    const int rest = bits - part_bits;
    const std::size_t parts = std::size_t{1} << part_bits;
    const auto part_of = [&](Key key) {
      return part_bits == 0 ? 0 : static_cast<std::size_t>(key >> rest);
    };
    // Each chunk of blocks counts its runs for each part, and then knows where they go.
    const index_t blocks = std::ssize(count_),
                  chunk = std::max<index_t>(least_chunk, (blocks + most_chunks - 1) / most_chunks);
    const auto chunks = static_cast<std::size_t>((blocks + chunk - 1) / chunk);
    std::vector<std::size_t> places(chunks * parts);
    const auto each_run = [&](auto f) {
      parallel_blocks(blocks, chunk, how_, [&](index_t c, index_t begin, index_t end) {
        std::size_t* const place = places.data() + static_cast<std::size_t>(c) * parts;
        for (index_t b = begin; b < end; ++b) {
          const key_run<Key>* const runs = runs_.data() + b * default_block_size;
          auto first = static_cast<std::int32_t>(b * default_block_size);
          // Looked up once: for all that a compiler knows, places may be counts.
          const std::size_t count = count_[b];
          for (std::size_t k = 0; k < count; ++k) {
            const auto [key, past, unused] = runs[k];
            f(place[part_of(key)], key_run<Key>{key, first, past - first});
            first = past;
          }
        }
      });
    };
    each_run([](std::size_t& place, const key_run<Key>&) { ++place; });
    parts_.assign(parts + 1, 0);
    for (std::size_t part = 0, next = 0; part < parts; ++part) {
      for (std::size_t c = 0; c < chunks; ++c)
        next += std::exchange(places[c * parts + part], next);
      parts_[part + 1] = next;
    }
    buffer<key_run<Key>> other(total);
    key_run<Key>* const to = other.data();
    each_run([to](std::size_t& place, const key_run<Key>& run) { to[place++] = run; });
    runs_ = runs_.first(total);
    for_each_part([&](std::size_t part) {
      const auto size = parts_[part + 1] - parts_[part];
      const auto runs = runs_.subspan(parts_[part], size);
      const auto sorted = std::span{other}.subspan(parts_[part], size);
      if (!radix_sort(sorted, runs, rest)) std::ranges::copy(sorted, runs.begin());
    });
  }

  template <class F>
  void for_each_part(F f) const {
    // Few at a time: some hold far more than others.
    parallel_blocks(std::ssize(parts_) - 1, 4, how_, [&](index_t, index_t begin, index_t end) {
      for (index_t part = begin; part < end; ++part) f(part);
    });
  }
  static constexpr index_t least_chunk = 32, most_chunks = 64;

  const execution& how_;
  // Of what there is room for, little is written where runs are long, so it is no `buffer`: large
  // pages are cleared whole.
  std::unique_ptr<key_run<Key>[]> room_;
  std::span<key_run<Key>> runs_;
  std::vector<std::size_t> count_;  ///< How many runs each block of points has, at first.
  std::vector<std::size_t> parts_;  ///< Where each part begins, and where the last ends.
};

}  // namespace cilantro
