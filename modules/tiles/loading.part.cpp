// SPDX-License-Identifier: MIT
//
// Points of files. Internal.
module cilantro.tiles:loading;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :region;
import :survey;

namespace cilantro {

/// Points, and their places in the order of the whole: numbers that were put aside with them, or
/// else ascend with the files and the places in them.
template <Scalar S, int D>
struct loaded_points {
  point_cloud<S, D> cloud;
  std::vector<std::uint64_t> order;
};

/// The finite points of a region, in the order of the whole, relative to the origin of the survey;
/// and those of the region that `more` answers with, if it does, when it is given their places in
/// any order.
template <Scalar S, int D>
loaded_points<S, D> load_region(
    const tile_survey<D>& survey, const tile_region<D>& region, const std::stop_token& stop,
    const std::function<std::optional<tile_region<D>>(point_matrix<S, D>)>& more = {});

}  // namespace cilantro
