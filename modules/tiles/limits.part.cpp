// SPDX-License-Identifier: MIT
//
// Steps whose limit all points together decide, as steps that look at their surroundings alone.
// Internal.
module cilantro.tiles:limits;

import cilantro.standard;
import cilantro.core;
import cilantro.geometry;
import cilantro.cloud;
import :tile_step;
import :tiled_cloud;

namespace cilantro {

/// A step that notes the number of each point as an attribute.
template <Scalar S, int D>
tile_step<S, D> noting(const tile_step<S, D>& step);
/// The step that, by what was noted, keeps what `step` keeps.
template <Scalar S, int D>
tile_step<S, D> keeping_noted(const tile_step<S, D>& step, double limit);

/// What was noted, of the points of a tile.
template <Scalar S, int D>
distance_statistics noted_statistics(const point_cloud<S, D>& tile);
/// What was noted, of all points of all tiles.
template <Scalar S, int D>
distance_statistics noted_statistics(const tiled_cloud<S, D>& cloud, const task_monitor& monitor);

/// Whether a step has a limit that all points together decide.
template <Scalar S, int D>
bool is_measuring(const tile_step<S, D>& step) {
  return bool(step.measure);
}

/// The steps with the limit of the first of them that measures. Goes through all tiles once.
template <Scalar S, int D>
std::vector<tile_step<S, D>> with_first_limit(const tiled_cloud<S, D>& cloud,
                                              const task_monitor& monitor);
/// The steps with limits that all points together have decided. Goes through all tiles once for
/// each step that measures.
template <Scalar S, int D>
std::vector<tile_step<S, D>> with_limits(const tiled_cloud<S, D>& cloud,
                                         const task_monitor& monitor);

}  // namespace cilantro
