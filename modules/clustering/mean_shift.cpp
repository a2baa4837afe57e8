// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
module cilantro.clustering;

namespace cilantro {

void expect_sensible(const mean_shift_options& options) {
  expect_from(0, options.merge_distance.value_or(0), "mean_shift: merge_distance");
  expect_from(0, options.tolerance, "mean_shift: tolerance");
  expect_from(0, options.max_iterations, "mean_shift: max_iterations");
}

template <Scalar S, int D>
merged_modes<S, D> merge_modes(points_view<S, D> places, std::span<const double> densities,
                               double distance, int threads) {
  std::vector<std::int32_t> found;
  point_matrix<S, D> climbed(places.dimension(), places.size());
  for (index_t i = 0; i < places.size(); ++i)
    if (densities[i] > 0) {
      climbed.col(std::ssize(found)) = places[i];
      found.push_back(static_cast<std::int32_t>(i));
    }
  climbed.conservativeResize(climbed.rows(), std::ssize(found));
  const auto near =
      connected_components(climbed, radius{distance}, always_similar{}, {.threads = threads});

  merged_modes<S, D> merged;
  merged.reached.assign(static_cast<std::size_t>(places.size()), clusters::none);
  merged.modes.resize(places.dimension(), near.size());
  for (index_t c = 0; c < near.size(); ++c) {
    std::int32_t densest = found[near[c].front()];
    for (const auto f : near[c]) {
      const auto i = found[f];
      merged.reached[i] = static_cast<clusters::label>(c);
      if (densities[i] > densities[densest]) densest = i;
    }
    merged.modes.col(c) = places[densest];
    merged.densities.push_back(densities[densest]);
  }
  return merged;
}

#define CILANTRO_INSTANTIATE(S, D) \
  template merged_modes<S, D> merge_modes(points_view<S, D>, std::span<const double>, double, int);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
