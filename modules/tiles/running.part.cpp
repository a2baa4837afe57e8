// SPDX-License-Identifier: MIT
//
// Tiles through steps, and many of them at a time. Internal.
module cilantro.tiles:running;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :communicator;
import :survey;
import :tile_step;
import :tiled_cloud;

namespace cilantro {

/// Whether the points of a tile are given their places in the order of the whole, as far as these
/// are known: see `first_with_places`.
enum class place_notes { none, kept };

/// A tile after all steps: the points in its square, or, if `halo` is positive, also those at most
/// that far away.
template <Scalar S, int D>
point_cloud<S, D> run_tile(const tile_survey<D>& survey, std::span<const tile_step<S, D>> steps,
                           const tile_info& tile, double halo, const std::stop_token& stop,
                           place_notes places = place_notes::none);

/// Whether a point is in the square of a tile.
template <Scalar S, int D>
bool is_in_tile(const point_cloud<S, D>& cloud, index_t i, const tile_info& tile, double edge);

/// How many bytes a tile may take while it goes through the steps. Throws `invalid_input` if that
/// is more than the memory.
template <Scalar S, int D>
std::uint64_t memory_of(const tile_survey<D>& survey, std::span<const tile_step<S, D>> steps,
                        const tile_info& tile, double halo);

/// How far around any tile the steps from number `first` on will look, once the points before them
/// are put aside: a guess, which is seldom too little.
template <Scalar S, int D>
double likely_border(const tile_survey<D>& survey, std::span<const tile_step<S, D>> steps,
                     std::size_t first);

/// The numbers of all tiles.
template <int D>
std::vector<index_t> all_tiles(const tile_survey<D>& survey) {
  std::vector<index_t> all(survey.tiles.size());
  std::iota(all.begin(), all.end(), index_t{0});
  return all;
}

/// Calls `work(t)` for all `tiles`, which are numbers of those of the survey, by as many `threads`
/// as the memory that `cost(t)` asks for is there for; the largest ones first. Of `ranks`, each
/// does some of them. Rethrows what is thrown for one of them, and begins no others after that.
/// Progress is by points.
template <int D>
void run_all(const tile_survey<D>& survey, const process_group* ranks,
             std::span<const index_t> tiles, int threads,
             const std::function<std::uint64_t(index_t)>& cost,
             const std::function<void(index_t)>& work, const task_monitor& monitor);

}  // namespace cilantro
