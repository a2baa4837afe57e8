// SPDX-License-Identifier: MIT
module cilantro.tiles;

import cilantro.eigen;
import :limits;
import :ranks;
import :running;
import :survey;
import :survey_around;

namespace cilantro {
namespace {

/// The same files, in squares that are halved until they are about as wide as `edge`.
template <int D>
std::shared_ptr<const tile_survey<D>> in_squares_of(std::shared_ptr<const tile_survey<D>> survey,
                                                    double edge) {
  constexpr double most_tiles = 1e6;
  std::int64_t parts = 1;
  while (survey->edge / double(parts) > 1.5 * edge &&
         double(survey->tiles.size()) * double(4 * parts * parts) <= most_tiles)
    parts *= 2;
  if (parts == 1) return survey;
  auto finer = std::make_shared<tile_survey<D>>(*survey);
  finer->edge /= double(parts);
  finer->tiles.clear();
  for (const auto& tile : survey->tiles)
    for (std::int64_t x = 0; x < parts; ++x)
      for (std::int64_t y = 0; y < parts; ++y)
        finer->tiles.push_back(
            {tile.x * parts + x, tile.y * parts + y, tile.points / std::uint64_t(parts * parts)});
  std::ranges::sort(finer->tiles, {}, [](const tile_info& t) { return tile_key{t.x, t.y}; });
  return finer;
}

}  // namespace

template <Scalar S, int D>
survey_around<S, D>::survey_around(const tiled_cloud<S, D>& cloud, double edge, double distance,
                                   const char* who, const task_monitor& monitor)
    : survey_{in_squares_of<D>(cloud.survey(), edge)}, ranks_{cloud.ranks()}, distance_{distance} {
  for (const auto& step : cloud.steps())
    expects(!step.moves_points,
            std::string{who} + ": what is near a place is not known after the step " + step.name +
                ", which moves points: write the result, and open it");
  // Distances may be rounded down to what is still within.
  margin_ = distance * (1 + 1e-5) + survey_->template slack<S>();
  steps_ = with_limits(cloud, monitor);
}

template <Scalar S, int D>
places_by_square survey_around<S, D>::by_square(const point_matrix<double, D>& places) const {
  expects(places.cols() <= std::numeric_limits<std::int32_t>::max(),
          "a cloud that is compared with a survey must have fewer than 2^31 points");
  places_by_square squares;
  const auto& bounds = survey_->bounds;
  for (index_t i = 0; i < places.cols(); ++i) {
    const point_vector<double, D> place = places.col(i) + origin();
    // Of points that are no mean of any, and of NaN, there is nothing near.
    bool may_be_near = !bounds.empty();
    for (int d = 0; d < D; ++d)
      may_be_near = may_be_near && bounds.lower[d] - margin_ <= place[d] &&
                    place[d] <= bounds.upper[d] + margin_;
    if (!may_be_near) continue;
    // The nearest place within the bounds is no farther from anything.
    std::array<double, 2> within;
    for (int d = 0; d < 2; ++d) within[d] = std::clamp(place[d], bounds.lower[d], bounds.upper[d]);
    squares[key_of(within, survey_->edge)].push_back(static_cast<std::int32_t>(i));
  }
  return squares;
}

template <Scalar S, int D>
tile_info survey_around<S, D>::info_of(const tile_key& square) const {
  const auto& tiles = survey_->tiles;
  const auto at = std::ranges::lower_bound(tiles, square, {},
                                           [](const tile_info& t) { return tile_key{t.x, t.y}; });
  if (at != tiles.end() && tile_key{at->x, at->y} == square) return *at;
  return {square.x, square.y, 0};
}

template <Scalar S, int D>
point_cloud<S, D> survey_around<S, D>::around(const tile_key& square,
                                              const std::stop_token& stop) const {
  return run_tile<S, D>(*survey_, steps_, info_of(square), margin_, stop);
}

template <Scalar S, int D>
std::uint64_t survey_around<S, D>::memory_around(const tile_key& square) const {
  const std::scoped_lock lock{mutex_};
  const auto [known, is_new] = known_memory_.try_emplace(square, 0);
  if (is_new) try {
      known->second = estimate_around(square);
    } catch (...) {
      known_memory_.erase(known);
      throw;
    }
  return known->second;
}

template <Scalar S, int D>
std::uint64_t survey_around<S, D>::estimate_around(const tile_key& square) const {
  const auto tile = info_of(square);
  const auto spread_evenly = memory_of<S, D>(*survey_, steps_, tile, margin_);
  double margin = margin_;
  for (const auto& step : steps_) margin += step.reach.distance;
  const double bytes = points_within(survey_->files, area_of(tile, survey_->edge, margin)) *
                       bytes_per_point<S, D>(survey_->parts);
  expects(bytes <= double(survey_->memory),
          "what a survey has around a square of " + in_digits(survey_->edge) + " may take " +
              std::to_string(std::llround(bytes / 1e6)) + " MB, and its memory is " +
              std::to_string(survey_->memory / 1'000'000) +
              " MB: open it with a smaller edge, or more memory");
  return std::max(spread_evenly, static_cast<std::uint64_t>(bytes));
}

template <Scalar S, int D>
std::uint64_t survey_around<S, D>::most_memory(const tile_area& area) const {
  const auto& bounds = survey_->bounds;
  std::array<double, 2> lower, upper;
  for (int d = 0; d < 2; ++d) {
    // For a square without points, those of its neighbours are read.
    lower[d] = std::max(area.lower[d], bounds.lower[d]) - margin_;
    upper[d] = std::min(area.upper[d], bounds.upper[d]) + margin_;
    if (!(lower[d] <= upper[d])) return 0;
    lower[d] = std::clamp(lower[d], bounds.lower[d], bounds.upper[d]);
    upper[d] = std::clamp(upper[d], bounds.lower[d], bounds.upper[d]);
  }
  const auto first = key_of(lower, survey_->edge), last = key_of(upper, survey_->edge);
  const auto& tiles = survey_->tiles;
  const auto from = [&](const tile_key& square) {
    return std::ranges::lower_bound(tiles, square, {},
                                    [](const tile_info& t) { return tile_key{t.x, t.y}; });
  };
  std::uint64_t most = 0;
  for (auto at = from(first); at != tiles.end() && at->x <= last.x;) {
    if (at->y < first.y) {
      at = from({at->x, first.y});
    } else if (at->y > last.y) {
      at = from({at->x + 1, first.y});
    } else {
      most = std::max(most, memory_around(tile_key{at->x, at->y}));
      ++at;
    }
  }
  return most;
}

template <Scalar S, int D>
std::uint64_t survey_around<S, D>::memory_around(const std::optional<tile_area>& area) const {
  if (area) return most_memory(*area);
  std::call_once(is_known_anywhere_, [&] {
    constexpr double far = std::numeric_limits<double>::infinity();
    memory_anywhere_ = most_memory({{-far, -far}, {far, far}});
  });
  return memory_anywhere_;
}

template <Scalar S, int D>
void survey_around<S, D>::for_each_square(
    const places_by_square& squares,
    const std::function<void(const tile_key&, const index_list&)>& work,
    const task_monitor& monitor, std::uint64_t reserved) const {
  // As if the places were the points of the tiles.
  tile_survey<D> as_tiles;
  as_tiles.threads = survey_->threads;
  as_tiles.memory = survey_->memory - reserved;
  std::vector<const index_list*> places;
  for (const auto& [square, indices] : squares) {
    as_tiles.tiles.push_back({square.x, square.y, indices.size()});
    places.push_back(&indices);
  }
  const auto square_of_tile = [&](index_t t) {
    return tile_key{as_tiles.tiles[t].x, as_tiles.tiles[t].y};
  };
  on_all_ranks(ranks_.get(), [&] {
    run_all<D>(
        as_tiles, ranks_.get(), all_tiles(as_tiles), as_tiles.threads,
        [&](index_t t) { return memory_around(square_of_tile(t)); },
        [&](index_t t) { work(square_of_tile(t), *places[t]); }, monitor);
  });
}

#define CILANTRO_INSTANTIATE(S, D) template class survey_around<S, D>;
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
