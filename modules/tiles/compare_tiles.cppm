// SPDX-License-Identifier: MIT
export module cilantro.tiles:compare_tiles;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :tile_step;
import :tiled_cloud;

namespace cilantro {

/// Options of `compare`.
export struct compare_options {
  /// Points with nothing so near are not paired, in the units of the points. It has no default: so
  /// much is read around each tile.
  positive max_distance;
  task_monitor monitor = {};
};

/// How far some points are from others, which are called the target.
export struct comparison {
  index_t points = 0;  ///< How many points there are.
  index_t pairs = 0;   ///< How many have a target point at most `max_distance` away.
  double overlap = 0;  ///< The share of those.
  double mean = 0;     ///< Of the distances of the pairs.
  double rmse = 0;     ///< Root mean square of the distances of the pairs.
  double maximum = 0;  ///< The largest distance of a pair.
};

/// How far the points of a survey are from the nearest points of another one, the target: what has
/// changed, or how accurate it is. Each after its steps; those of the target must not move points.
/// Distances are computed in double, in world coordinates, and summed up without rounding: the same
/// bits for any tiles, threads and ranks. All zero without points.
///
/// For each tile, the target is read as far as `max_distance` around it; so a target with steps
/// that take long is better written first. Threads, memory and ranks are those of the survey that
/// is compared; put the target `.on(world)`, too, if limits have to be decided for its steps.
/// O(N log M). Throws `invalid_input`, `io_error`, what steps throw, and `cancelled`.
export template <Scalar S, int D>
[[nodiscard]] comparison compare(const tiled_cloud<S, D>& survey, const tiled_cloud<S, D>& target,
                                 const compare_options& options);
/// As above, of a cloud in memory. Its points that are not finite are left out. Threads, memory and
/// ranks are those of the target; all ranks have the same cloud.
export template <Scalar S, int D>
[[nodiscard]] comparison compare(const point_cloud<S, D>& cloud, const tiled_cloud<S, D>& target,
                                 const compare_options& options);

/// Options of `distances_to`.
export struct distances_to_options {
  /// How far to look, in the units of the points: the distance of points with nothing so near.
  positive max_distance;
  std::string attribute = "distance";  ///< The attribute that distances are written to.
  /// Watches the limits of the steps of the target being decided. `stop` is looked at also where
  /// the step is applied, which then throws `cancelled`.
  task_monitor monitor = {};
};

template <Scalar S, int D>
class survey_around;

/// What `distances_to` returns: `near` is the survey that is looked at.
export template <Scalar S, int D>
struct distances_to_step : pipeline_step {
  std::shared_ptr<const survey_around<S, D>> near;
  std::string attribute;  ///< The attribute that distances are written to.
  std::stop_token stop;   ///< What ends its work.
  std::string target;     ///< Which survey is looked at, in words.

  static constexpr const char* name = "distances_to";
  /// It looks at another survey, and at each point by itself.
  static step_reach reach() { return {}; }
  /// What a run over tiles that is resumed must have in common with the one before. Internal.
  [[nodiscard]] std::string about() const;
  /// How many bytes the points of the target may take that are looked at for points of an area,
  /// or anywhere. Internal.
  [[nodiscard]] std::uint64_t more_memory(const std::optional<tile_area>& area) const;
  point_cloud<S, D> operator()(point_cloud<S, D> cloud) const;
};

/// A step that gives each point its distance to the nearest point of `target`, in the scalar of the
/// points, as `compare` does it; `max_distance` if there is none so near, and NaN for points that
/// are not finite: `survey | distances_to(last_year, {.max_distance = 2}) |
/// write_tiles("changes")`. Clouds in memory take it, too.
///
/// Limits of the steps of `target` are decided here. A target `.on(world)` shares that work among
/// the ranks, so that all of them must call this, as they call whatever else works on tiles; of
/// another target, each rank decides for itself. What is read of the target for a tile is in the
/// estimate of its memory, and must fit that of the target, too. A run that is resumed must have
/// the same target, distance and attribute. Throws as `compare` does.
export template <Scalar S, int D>
[[nodiscard]] distances_to_step<S, D> distances_to(const tiled_cloud<S, D>& target,
                                                   const distances_to_options& options);

template <Scalar S, int D>
inline constexpr bool keeps_points<distances_to_step<S, D>> = true;

#define CILANTRO_COMPILED_ELSEWHERE(S, D) extern template struct distances_to_step<S, D>;
CILANTRO_COMPILED_ELSEWHERE(float, 2)
CILANTRO_COMPILED_ELSEWHERE(float, 3)
CILANTRO_COMPILED_ELSEWHERE(double, 2)
CILANTRO_COMPILED_ELSEWHERE(double, 3)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
