// SPDX-License-Identifier: MIT
//
// Some points of a survey, the same for any tiles and ranks. Internal.
module cilantro.tiles:place_sample;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :tiled_cloud;

namespace cilantro {

/// Different places of points, relative to the origin of the survey, in random order.
template <Scalar S, int D>
struct place_sample {
  index_t points = 0;  ///< How many points there are in all.
  point_matrix<S, D> places;
};

/// `count` different places, or all if there are fewer: those whose hashes, of the seed and the
/// coordinates, are the least. Nothing else decides, so each place is as likely as any other. One
/// pass. Precondition: the limits of the steps are decided.
/// Source: Cohen & Kaplan 2007, "Summarizing data using bottom-k sketches".
template <Scalar S, int D>
place_sample<S, D> sample_places(const tiled_cloud<S, D>& cloud, index_t count, std::uint64_t seed,
                                 const task_monitor& monitor);

}  // namespace cilantro
