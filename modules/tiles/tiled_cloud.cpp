// SPDX-License-Identifier: MIT
module;
#include <set>
module cilantro.tiles;

import cilantro.eigen;
import :limits;
import :loading;
import :ranks;
import :reduce_tiles;
import :region;
import :running;
import :survey;

namespace cilantro {
namespace {

/// The survey with the tiles that may have points only after steps that look `reach` around them,
/// such as the mean of points in other tiles.
template <Scalar S, int D>
std::shared_ptr<const tile_survey<D>> with_tiles_around(
    std::shared_ptr<const tile_survey<D>> survey, double reach) {
  constexpr double most_tiles = 1e7;
  const double wide = std::ceil(reach / survey->edge);
  if (!(wide > 0) || survey->tiles.empty()) return survey;
  std::set<tile_key> around;
  // Nothing is beyond the points of all tiles, but by rounding: the mean of some is among them.
  auto bounds = survey->bounds;
  for (int d = 0; d < D; ++d) {
    bounds.lower[d] -= survey->template slack<S>();
    bounds.upper[d] += survey->template slack<S>();
  }
  const auto first = key_of(bounds.lower, survey->edge), last = key_of(bounds.upper, survey->edge);
  const auto far = static_cast<std::int64_t>(
      std::min(wide, double(std::max(last.x - first.x, last.y - first.y)) + 1));
  for (const auto& tile : survey->tiles) {
    around.insert({tile.x, tile.y});
    if (tile.points == 0) continue;
    for (auto x = std::max(first.x, tile.x - far); x <= std::min(last.x, tile.x + far); ++x)
      for (auto y = std::max(first.y, tile.y - far); y <= std::min(last.y, tile.y + far); ++y)
        around.insert({x, y});
    expects(double(around.size()) <= most_tiles,
            "steps that look much farther than a tile is wide would make more than 10 million "
            "tiles: open them with a larger edge");
  }
  if (around.size() == survey->tiles.size()) return survey;
  auto more = std::make_shared<tile_survey<D>>(*survey);
  for (const auto& tile : survey->tiles) around.erase({tile.x, tile.y});
  for (const auto& key : around) more->tiles.push_back({key.x, key.y, 0});
  std::ranges::sort(more->tiles, {}, [](const tile_info& t) { return tile_key{t.x, t.y}; });
  return more;
}

}  // namespace

template <Scalar S, int D>
  requires(D == 2 || D == 3)
tiled_cloud<S, D>::tiled_cloud(std::shared_ptr<const tile_survey<D>> survey,
                               std::vector<tile_step<S, D>> steps,
                               std::shared_ptr<const process_group> ranks)
    : survey_{std::move(survey)}, steps_{std::move(steps)}, ranks_{std::move(ranks)} {
  double reach = 0;
  for (const auto& step : steps_)
    if (!step.reach.everything) reach += step.reach.distance;
  survey_ = with_tiles_around<S, D>(std::move(survey_), reach);
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
std::uint64_t tiled_cloud<S, D>::size() const {
  return survey_->points;
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
box tiled_cloud<S, D>::bounds() const {
  expects(!survey_->bounds.empty(), "tiled_cloud: there are no points, so that there is no box");
  return {survey_->bounds.lower, survey_->bounds.upper};
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
double tiled_cloud<S, D>::edge() const {
  return survey_->edge;
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
point_vector<double, D> tiled_cloud<S, D>::origin() const {
  return survey_->origin;
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
const std::vector<tile_info>& tiled_cloud<S, D>::tiles() const {
  return survey_->tiles;
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
std::vector<std::filesystem::path> tiled_cloud<S, D>::files() const {
  std::vector<std::filesystem::path> all;
  for (const auto& file : survey_->files) all.push_back(file.path);
  return all;
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
point_cloud<S, D> tiled_cloud<S, D>::read() const {
  const auto& survey = *survey_;
  const auto steps = with_limits<S, D>({survey_, steps_}, {});
  std::vector<point_cloud<S, D>> parts(survey.tiles.size());
  run_all<D>(
      survey, nullptr, all_tiles(survey), survey.threads,
      [&](index_t t) { return memory_of<S, D>(survey, steps, survey.tiles[t], 0); },
      [&](index_t t) { parts[t] = run_tile<S, D>(survey, steps, survey.tiles[t], 0, {}); }, {});
  for (std::size_t t = 1; t < parts.size(); ++t) parts[t].comments.clear();
  return append_all(parts);
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
point_cloud<S, D> tiled_cloud<S, D>::read_tile(index_t number) const {
  expects(0 <= number && number < std::ssize(survey_->tiles),
          "read_tile: there is no tile of that number");
  return run_tile<S, D>(*survey_, with_limits<S, D>({survey_, steps_}, {}), survey_->tiles[number],
                        0, {});
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
point_cloud<S, D> tiled_cloud<S, D>::read_box(const box& region) const {
  region.check(region.lower.size());
  expects(region.lower.size() == 2 || region.lower.size() == D,
          "read_box: the box must have two dimensions, or those of the points");
  auto found = load_region<S, D>(*survey_,
                                 tile_region<D>{{region.lower[0], region.lower[1]},
                                                {region.upper[0], region.upper[1]}},
                                 {})
                   .cloud;
  return region.lower.size() == D ? crop(std::move(found), region) : found;
}

template <Scalar S, int D>
void visit_tiles(const tiled_cloud<S, D>& cloud, double halo, const for_each_tile_options& options,
                 const std::function<void(tile<S, D>&)>& f) {
  expect_between(0, halo, 1e300, "for_each_tile: halo");
  for (const auto& step : cloud.steps())
    expects(halo == 0 || !step.moves_points,
            "for_each_tile: the surroundings of a tile are not "
            "known after the step " +
                step.name + ", which moves points");
  const auto& survey = *cloud.survey();
  const auto monitor = in_passes(options.monitor, 1 + passes_of_limits(cloud));
  const auto steps = with_limits(cloud, monitor);
  const auto visit = [&](index_t t) {
    tile<S, D> next{
        survey.tiles[t], run_tile<S, D>(survey, steps, survey.tiles[t], halo, monitor.stop), {}};
    for (index_t i = 0; i < next.cloud.size(); ++i)
      if (halo == 0 || is_in_tile(next.cloud, i, next.info, survey.edge))
        next.inside.push_back(static_cast<std::int32_t>(i));
    if (!next.inside.empty()) f(next);
  };
  const auto cost = [&](index_t t) {
    return memory_of<S, D>(survey, steps, survey.tiles[t], halo);
  };
  on_all_ranks(cloud.ranks().get(), [&] {
    run_all<D>(survey, cloud.ranks().get(), all_tiles(survey),
               options.parallel ? survey.threads : 1, cost, visit, monitor);
  });
}

#define CILANTRO_INSTANTIATE(S, D)                                                          \
  template class tiled_cloud<S, D>;                                                         \
  template void visit_tiles(const tiled_cloud<S, D>&, double, const for_each_tile_options&, \
                            const std::function<void(tile<S, D>&)>&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
