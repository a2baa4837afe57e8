// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <cstdint>
#include <stop_token>
#include <utility>
#include <vector>
module cilantro.tiles;

import cilantro.eigen;
import :loading;
import :region;
import :survey;

namespace cilantro {
namespace {

/// The points `first` to `end` − 1 of a file that are in the region, in pieces.
template <Scalar S, int D>
void load_range(cloud_reader<S, D>& reader, const survey_file<D>& file, std::uint64_t first,
                std::uint64_t end, const tile_survey<D>& survey, const tile_region<D>& region,
                std::vector<point_cloud<S, D>>& parts) {
  constexpr std::uint64_t at_a_time = 16 * points_of_a_run;
  reader.seek(first);
  while (first < end) {
    auto piece = reader.read(static_cast<index_t>(std::min(at_a_time, end - first)));
    if (piece.empty()) throw io_error{file.path, "has fewer points than it had"};
    first += static_cast<std::uint64_t>(piece.size());
    index_list wanted;
    for (index_t i = 0; i < piece.size(); ++i) {
      const auto place = world_of<S, D>(piece.points.col(i), survey.origin);
      if (is_finite(place) && region.contains(place)) wanted.push_back(std::int32_t(i));
    }
    if (wanted.empty()) continue;
    conform(piece, survey.parts, file.path);
    parts.push_back(std::ssize(wanted) == piece.size() ? std::move(piece) : select(piece, wanted));
  }
}

}  // namespace

template <Scalar S, int D>
point_cloud<S, D> load_region(const tile_survey<D>& survey, const tile_region<D>& region,
                              const std::stop_token& stop) {
  std::vector<point_cloud<S, D>> parts;
  for (const auto& file : survey.files) {
    std::optional<cloud_reader<S, D>> reader;
    std::uint64_t first = 0, begin = 0;
    bool is_wanted = false;
    const auto take_up_to = [&](std::uint64_t end) {
      if (!reader) {
        expect_unchanged(file);
        reader.emplace(file.path, read_options{.monitor = {.stop = stop}});
        reader->set_origin(survey.origin);
      }
      load_range(*reader, file, begin, end, survey, region, parts);
    };
    for (const auto& run : file.runs) {
      const bool meets = region.may_meet(run.box);
      if (meets && !is_wanted) begin = first;
      if (!meets && is_wanted) take_up_to(first);
      is_wanted = meets;
      first += run.count;
    }
    if (is_wanted) take_up_to(first);
  }
  for (std::size_t i = 1; i < parts.size(); ++i) parts[i].comments.clear();
  auto all = append_all(parts);
  all.origin = survey.origin;
  return all;
}

#define CILANTRO_INSTANTIATE(S, D)                                                     \
  template point_cloud<S, D> load_region(const tile_survey<D>&, const tile_region<D>&, \
                                         const std::stop_token&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
