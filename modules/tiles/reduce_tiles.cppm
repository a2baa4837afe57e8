// SPDX-License-Identifier: MIT
export module cilantro.tiles:reduce_tiles;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :communicator;
import :for_each_tile;
import :tiled_cloud;

namespace cilantro {

/// What tiles add up to: a plain value, whose bytes ranks can send each other, with `+=`.
///
/// Semantics: `a += b` gives the same bits in whatever order, and however grouped, values are
/// added. So counts, `exact_sum`, minima and maxima, and structs and arrays of them; a sum of
/// doubles is none, since it is rounded each time. Where ties are broken, they must be by what the
/// points have, such as the least coordinates, and not by who comes first.
export template <class T>
concept TileSum = !std::floating_point<T> && std::copyable<T> && requires(T& sum, const T& other) {
  sum += other;
  std::bit_cast<std::array<std::byte, sizeof(T)>>(other);
};

/// Options of `reduce_tiles`, and of the functions of all points that have none of their own.
export struct reduce_tiles_options {
  task_monitor monitor = {};
};

/// How many passes over all tiles the limits of the steps take, as progress counts them.
template <Scalar S, int D>
[[nodiscard]] int passes_of_limits(const tiled_cloud<S, D>& cloud) {
  int passes = 0;
  for (const auto& step : cloud.steps()) passes += step.measure ? 1 : 0;
  return passes;
}

/// Adds up what all ranks have, so that all have the same. Collective.
template <TileSum T>
void add_up_over_ranks(const process_group* ranks, std::vector<T>& sums) {
  if (ranks == nullptr) return;
  using bytes_of_one = std::array<std::byte, sizeof(T)>;
  std::vector<std::byte> mine;
  mine.reserve(sums.size() * sizeof(T));
  for (const T& sum : sums) {
    const auto bytes = std::bit_cast<bytes_of_one>(sum);
    mine.insert(mine.end(), bytes.begin(), bytes.end());
  }
  const auto all = ranks->all_gather(mine);
  for (index_t r = 0; r < std::ssize(all); ++r) {
    if (all[r].size() != mine.size()) throw std::runtime_error{"ranks add up different sums"};
    for (index_t s = 0; s < std::ssize(sums); ++s) {
      bytes_of_one bytes;
      std::copy_n(all[r].data() + s * std::ssize(bytes), bytes.size(), bytes.begin());
      const T theirs = std::bit_cast<T>(bytes);
      if (r == 0)
        sums[s] = theirs;
      else
        sums[s] += theirs;
    }
  }
}

/// Adds up over all tiles, after the steps of `cloud`: calls `visit(tile, sums)` for each tile that
/// has points, as `for_each_tile` does but by several threads at once, with `sums` as `zeros` are,
/// and returns the sum of what these then are. The same bits for any tiles, threads and ranks, if
/// `visit` adds the points inside one by one; with `.on(world)`, all ranks get all of it.
///
/// `zeros` must add nothing: 0 for sums, ∞ for minima. Memory beside that of `for_each_tile`: the
/// sums, once for each tile at work. Throws as `for_each_tile` does, and what `visit` throws.
export template <Scalar S, int D, TileSum T, std::invocable<tile<S, D>&, std::vector<T>&> F>
[[nodiscard]] std::vector<T> reduce_tiles(const tiled_cloud<S, D>& cloud, halo around,
                                          const std::vector<T>& zeros, F&& visit,
                                          const reduce_tiles_options& options = {}) {
  auto sums = zeros;
  std::mutex mutex;
  for_each_tile(cloud, around,
                [&](tile<S, D>& t) {
                  auto found = zeros;
                  visit(t, found);
                  expects(found.size() == zeros.size(),
                          "reduce_tiles: visit must leave the number of sums as it is");
                  const std::scoped_lock lock{mutex};
                  for (index_t s = 0; s < std::ssize(sums); ++s) sums[s] += found[s];
                },
                {.parallel = true, .monitor = options.monitor});
  add_up_over_ranks(cloud.ranks().get(), sums);
  return sums;
}
/// As above, of a single sum: `reduce_tiles(survey, halo{0}, index_t{0}, [](const auto& t, index_t&
/// sum) { sum += std::ssize(t.inside); })`.
export template <Scalar S, int D, TileSum T, std::invocable<tile<S, D>&, T&> F>
[[nodiscard]] T reduce_tiles(const tiled_cloud<S, D>& cloud, halo around, const T& zero, F&& visit,
                             const reduce_tiles_options& options = {}) {
  return reduce_tiles(
             cloud, around, std::vector<T>{zero},
             [&](tile<S, D>& t, std::vector<T>& sums) { visit(t, sums.front()); }, options)
      .front();
}

}  // namespace cilantro
