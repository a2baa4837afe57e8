// SPDX-License-Identifier: MIT
//
// Points of files. Internal.
module;
#include <stop_token>
module cilantro.tiles:loading;

import cilantro.core;
import cilantro.cloud;
import :region;
import :survey;

namespace cilantro {

/// The finite points of a region, in the order of the files, relative to the origin of the survey.
template <Scalar S, int D>
point_cloud<S, D> load_region(const tile_survey<D>& survey, const tile_region<D>& region,
                              const std::stop_token& stop);

}  // namespace cilantro
