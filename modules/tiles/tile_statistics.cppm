// SPDX-License-Identifier: MIT
export module cilantro.tiles:tile_statistics;

import cilantro.standard;
import cilantro.core;
import cilantro.geometry;
import cilantro.cloud;
import :reduce_tiles;
import :tiled_cloud;

namespace cilantro {

/// The mean, relative to `cloud.origin()`, and the covariance of all points after the steps of
/// `cloud`; nothing if there are none. As of the whole cloud in memory, but summed without rounding
/// and rounded at the end, so that the bits do not depend on tiles, threads and ranks. One pass;
/// O(N·D²). Throws as `reduce_tiles` does.
export template <Scalar S, int D>
[[nodiscard]] std::optional<moments<S, D>> mean_and_covariance(
    const tiled_cloud<S, D>& cloud, const reduce_tiles_options& options = {});

/// The smallest box with all points after the steps of `cloud`, in world coordinates; nothing if
/// there are none. Without steps, `cloud.bounds()` is the same at once. One pass. Throws as
/// `reduce_tiles` does.
export template <Scalar S, int D>
[[nodiscard]] std::optional<box> bounds_of(const tiled_cloud<S, D>& cloud,
                                           const reduce_tiles_options& options = {});

/// What all points have together of an attribute.
export struct attribute_statistics {
  index_t count = 0;           ///< How many values are finite; the others are left out.
  double least = 0, most = 0;  ///< The range of the values.
  double mean = 0;             ///< Of the values.
  double deviation = 0;        ///< Standard deviation, by count − 1; 0 for a single value.
};

/// Range, mean and deviation of the attribute of that name, such as "intensity", of all points
/// after the steps of `cloud`; nothing if there are no finite values. Summed without rounding, as
/// doubles. One pass; O(N). Throws as `reduce_tiles` does, and `invalid_input` if there are points
/// and they have no attribute of that name.
export template <Scalar S, int D>
[[nodiscard]] std::optional<attribute_statistics> statistics_of(
    const tiled_cloud<S, D>& cloud, std::string_view attribute,
    const reduce_tiles_options& options = {});

}  // namespace cilantro
