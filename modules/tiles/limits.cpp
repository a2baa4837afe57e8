// SPDX-License-Identifier: MIT
module cilantro.tiles;

import cilantro.eigen;
import cilantro.geometry;
import :limits;
import :survey;
import :tile_sums;

namespace cilantro {
namespace {

/// The name of an attribute that no file of anybody else has.
constexpr const char* noted_name = "cilantro_noted";

template <Scalar S, int D>
point_cloud<S, D> keep_up_to(double limit, std::span<const double> values,
                             point_cloud<S, D>&& cloud) {
  index_list kept;
  for (index_t i = 0; i < cloud.size(); ++i)
    if (values[i] <= limit) kept.push_back(static_cast<std::int32_t>(i));
  return select(std::move(cloud), kept);
}

/// The step once its limit is known.
template <Scalar S, int D>
tile_step<S, D> limited(const tile_step<S, D>& step, double limit) {
  auto local = step;
  local.apply = [measure = step.measure, limit](point_cloud<S, D>&& cloud) {
    return keep_up_to(limit, measure(cloud), std::move(cloud));
  };
  local.measure = {};
  local.limit = {};
  return local;
}

}  // namespace

template <Scalar S, int D>
tile_step<S, D> noting(const tile_step<S, D>& step) {
  auto notes = step;
  notes.apply = [measure = step.measure](point_cloud<S, D>&& cloud) {
    auto values = measure(cloud);
    cloud.set_attribute(noted_name, attribute_values{std::move(values)});
    return std::move(cloud);
  };
  notes.measure = {};
  notes.limit = {};
  return notes;
}

template <Scalar S, int D>
tile_step<S, D> keeping_noted(const tile_step<S, D>& step, double limit) {
  return {step.name, {}, false, false, {true}, [limit](point_cloud<S, D>&& cloud) {
            if (cloud.empty()) return std::move(cloud);
            const auto values = cloud.template attribute_to<double>(noted_name);
            std::erase_if(cloud.attributes,
                          [](const attribute& a) { return a.name == noted_name; });
            return keep_up_to(limit, values, std::move(cloud));
          }};
}

template <Scalar S, int D>
distance_statistics noted_statistics(const point_cloud<S, D>& tile) {
  if (tile.empty()) return {};
  return statistics_of(tile.template attribute_as<double>(noted_name), {.threads = 1});
}

template <Scalar S, int D>
distance_statistics noted_statistics(const tiled_cloud<S, D>& cloud, const task_monitor& monitor) {
  return sum_over_tiles(
             cloud, std::vector<distance_statistics>(1), monitor,
             [](const point_cloud<S, D>& points, std::vector<distance_statistics>& sums) {
               sums.front() += noted_statistics(points);
             })
      .front();
}

template <Scalar S, int D>
std::vector<tile_step<S, D>> with_first_limit(const tiled_cloud<S, D>& cloud,
                                              const task_monitor& monitor) {
  auto steps = cloud.steps();
  const auto next = std::ranges::find_if(steps, is_measuring<S, D>);
  if (next == steps.end()) return steps;
  std::vector<tile_step<S, D>> measuring{steps.begin(), next};
  measuring.push_back(noting(*next));
  const tiled_cloud<S, D> measured{cloud.survey(), std::move(measuring), cloud.ranks()};
  *next = limited(*next, next->limit(noted_statistics(measured, monitor)));
  return steps;
}

template <Scalar S, int D>
std::vector<tile_step<S, D>> with_limits(const tiled_cloud<S, D>& cloud,
                                         const task_monitor& monitor) {
  auto steps = cloud.steps();
  while (std::ranges::any_of(steps, is_measuring<S, D>))
    steps = with_first_limit<S, D>({cloud.survey(), std::move(steps), cloud.ranks()}, monitor);
  return steps;
}

#define CILANTRO_INSTANTIATE(S, D)                                                              \
  template tile_step<S, D> noting(const tile_step<S, D>&);                                      \
  template tile_step<S, D> keeping_noted(const tile_step<S, D>&, double);                       \
  template distance_statistics noted_statistics(const point_cloud<S, D>&);                      \
  template distance_statistics noted_statistics(const tiled_cloud<S, D>&, const task_monitor&); \
  template std::vector<tile_step<S, D>> with_first_limit(const tiled_cloud<S, D>&,              \
                                                         const task_monitor&);                  \
  template std::vector<tile_step<S, D>> with_limits(const tiled_cloud<S, D>&, const task_monitor&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
