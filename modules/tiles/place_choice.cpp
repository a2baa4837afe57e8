// SPDX-License-Identifier: MIT
module cilantro.tiles;

import cilantro.eigen;
import :places;
import :survey;

namespace cilantro {

place_choice choose_first(std::uint64_t size, index_t count) {
  expect_from(0, double(count), "take: the count");
  const auto kept = std::min(size, static_cast<std::uint64_t>(count));
  return {kept, [kept](std::uint64_t place) {
            return place < kept ? std::optional{place} : std::nullopt;
          }};
}

place_choice choose_every(std::uint64_t size, index_t n) {
  expect_from(1, double(n), "stride: n");
  const auto each = static_cast<std::uint64_t>(n);
  return {size / each + (size % each > 0 ? 1 : 0),
          [each](std::uint64_t place) {
            return place % each == 0 ? std::optional{place / each} : std::nullopt;
          },
          double(each)};
}

place_choice choose_listed(std::uint64_t size, const std::string& name,
                           const std::function<index_list(index_t)>& indices) {
  constexpr std::uint64_t most = std::numeric_limits<std::int32_t>::max();
  expects(size <= most, "the step " + name + " chooses of less than 2^31 points: stride(n), or " +
                            "voxel_downsample, do of more");
  auto list = indices(static_cast<index_t>(size));
  std::ranges::sort(list);
  const auto count = list.size();
  return {count,
          [list = std::make_shared<const index_list>(std::move(list))](
              std::uint64_t place) -> std::optional<std::uint64_t> {
            const auto at = std::ranges::lower_bound(*list, static_cast<std::int64_t>(place));
            if (at == list->end() || std::cmp_not_equal(*at, place)) return std::nullopt;
            return static_cast<std::uint64_t>(at - list->begin());
          },
          double(size) / double(std::max(count, std::size_t{1}))};
}

namespace {

/// What `next` chooses of what `before` has chosen.
place_choice after(const place_choice& before, const place_choice& next) {
  return {next.count,
          [first = before.place_of,
           second = next.place_of](std::uint64_t place) -> std::optional<std::uint64_t> {
            const auto between = first(place);
            return between ? second(*between) : std::nullopt;
          },
          before.thinning * next.thinning};
}

std::string not_known(const std::string& step, const std::string& where) {
  return "the step " + step + " chooses points by their places in the whole, which no tile knows " +
         where;
}

}  // namespace

template <Scalar S, int D>
void decide_places(const tile_survey<D>& survey, std::vector<tile_step<S, D>>& steps) {
  if (std::ranges::none_of(steps, [](const auto& step) { return bool(step.choice); })) return;
  std::uint64_t finite = 0;
  for (const auto& tile : survey.tiles) finite += tile.points;
  auto chosen = std::make_shared<const place_choice>(
      place_choice{survey.points, [](std::uint64_t place) { return std::optional{place}; }});
  std::string removed_by;
  for (auto& step : steps) {
    if (!step.choice) {
      if (!step.keeps_all && removed_by.empty()) removed_by = step.name;
      continue;
    }
    expects(removed_by.empty(), not_known(step.name, "after the step " + removed_by +
                                                         ": put it before, write what comes before "
                                                         "it and open that, or choose by "
                                                         "voxel_downsample, or with_reach(0, …) by "
                                                         "what a point has"));
    expects(finite == survey.points,
            not_known(step.name,
                      "where points are not finite: write them, which leaves those out, and choose "
                      "of what write_tiles returns"));
    if (!step.chosen) {
      step.chosen =
          std::make_shared<const place_choice>(after(*chosen, step.choice(chosen->count)));
      step.apply = [all = step.chosen](point_cloud<S, D>&& cloud) {
        index_list kept;
        const auto places = places_of(cloud);
        for (index_t i = 0; i < std::ssize(places); ++i)
          if (all->place_of(places[i])) kept.push_back(static_cast<std::int32_t>(i));
        return select(std::move(cloud), kept);
      };
    }
    chosen = step.chosen;
  }
}

#define CILANTRO_INSTANTIATE(S, D) \
  template void decide_places(const tile_survey<D>&, std::vector<tile_step<S, D>>&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
