// SPDX-License-Identifier: MIT
//
// What several passes over all tiles share. Internal.
module cilantro.tiles:tile_sums;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :communicator;
import :limits;
import :ranks;
import :reduce_tiles;
import :running;
import :survey;
import :tiled_cloud;

namespace cilantro {

/// Makes the points of a tile relative to the origin of the survey, which a step that moves points
/// has changed.
template <Scalar S, int D>
void relate_to(const point_vector<double, D>& origin, point_cloud<S, D>& cloud) {
  const point_vector<double, D> shift = cloud.full_origin() - origin;
  if (!shift.isZero(0))
    cloud.points = (cloud.points.template cast<double>().colwise() + shift).template cast<S>();
  cloud.origin = origin;
}

/// The cloud with steps whose limits are decided once, for any number of passes.
template <Scalar S, int D>
tiled_cloud<S, D> with_decided_steps(const tiled_cloud<S, D>& cloud, const task_monitor& monitor) {
  return {cloud.survey(), with_limits(cloud, monitor), cloud.ranks()};
}

/// Calls `visit(points)` for the points of each tile that has some, by several threads, and shared
/// among all ranks. `more_memory(t)` is what visiting tile number t takes beside its points.
/// Precondition: the limits of the steps are decided.
template <Scalar S, int D, class F>
void visit_points(const tiled_cloud<S, D>& cloud,
                  const std::function<std::uint64_t(index_t)>& more_memory,
                  const task_monitor& monitor, F visit) {
  const auto& survey = *cloud.survey();
  on_all_ranks(cloud.ranks().get(), [&] {
    run_all<D>(
        survey, cloud.ranks().get(), all_tiles(survey), survey.threads,
        [&](index_t t) {
          const auto needed =
              memory_of<S, D>(survey, cloud.steps(), survey.tiles[t], 0) + more_memory(t);
          expects(needed <= survey.memory,
                  "a tile, with what is summed up or looked at for it, needs " +
                      std::to_string(needed / 1'000'000) +
                      " MB, more than .memory of open_tiles: " +
                      "have more memory, or a smaller .edge");
          return needed;
        },
        [&](index_t t) {
          auto points = run_tile<S, D>(survey, cloud.steps(), survey.tiles[t], 0, monitor.stop);
          if (!points.empty()) visit(std::move(points));
        },
        monitor);
  });
}

/// Adds up what `visit(points, sums)` adds to sums for the points of each tile, as `visit_points`
/// goes through them.
template <TileSum T, Scalar S, int D, class F>
std::vector<T> sum_over_tiles(const tiled_cloud<S, D>& cloud, const std::vector<T>& zeros,
                              const std::function<std::uint64_t(index_t)>& more_memory,
                              const task_monitor& monitor, F visit) {
  auto sums = zeros;
  std::mutex mutex;
  visit_points(cloud, more_memory, monitor, [&](point_cloud<S, D>&& points) {
    auto found = zeros;
    visit(std::move(points), found);
    const std::scoped_lock lock{mutex};
    for (std::size_t s = 0; s < sums.size(); ++s) sums[s] += found[s];
  });
  add_up_over_ranks(cloud.ranks().get(), sums);
  return sums;
}
/// As above, where visiting takes no more memory than the work on a tile.
template <TileSum T, Scalar S, int D, class F>
std::vector<T> sum_over_tiles(const tiled_cloud<S, D>& cloud, const std::vector<T>& zeros,
                              const task_monitor& monitor, F visit) {
  return sum_over_tiles(cloud, zeros, [](index_t) { return std::uint64_t{0}; }, monitor, visit);
}

}  // namespace cilantro
