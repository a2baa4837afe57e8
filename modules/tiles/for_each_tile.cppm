// SPDX-License-Identifier: MIT
export module cilantro.tiles:for_each_tile;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :tiled_cloud;

namespace cilantro {

/// How much of its surroundings a tile is given, in the units of the points.
export struct halo {
  double distance = 0;  ///< From the square of the tile.
};

/// A tile with its surroundings.
export template <Scalar S, int D>
struct tile {
  tile_info info;           ///< Which one it is.
  point_cloud<S, D> cloud;  ///< Its points and those at most the halo away from its square.
  index_list inside;        ///< Which of the points are in the tile itself, ascending.
};

/// Options of `for_each_tile`.
export struct for_each_tile_options {
  /// Whether `f` may be called by several threads at once, for different tiles. Otherwise it is
  /// called for one tile after the other, the largest first, on the thread of the caller.
  bool parallel = false;
  task_monitor monitor = {};
};

template <Scalar S, int D>
void visit_tiles(const tiled_cloud<S, D>& cloud, double halo, const for_each_tile_options& options,
                 const std::function<void(tile<S, D>&)>& f);

/// Calls `f(tile)` for each tile that has points, after the steps of `cloud`, which see as much
/// more of the surroundings as they reach. `f` may change the tile. Throws what `f` throws,
/// `cancelled`, `io_error`, and `invalid_input` for a halo that is negative or infinite.
export template <Scalar S, int D, std::invocable<tile<S, D>&> F>
void for_each_tile(const tiled_cloud<S, D>& cloud, halo around, F&& f,
                   const for_each_tile_options& options = {}) {
  visit_tiles<S, D>(cloud, around.distance, options, [&f](tile<S, D>& t) { f(t); });
}

}  // namespace cilantro
