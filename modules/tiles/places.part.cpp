// SPDX-License-Identifier: MIT
//
// The places that points have in the order of the whole, and points as they are put aside between
// two passes. Internal.
module cilantro.tiles:places;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :survey;
import :tile_step;
import :tiled_cloud;

namespace cilantro {

/// From which step on the points of a tile have places: numbers that ascend as the points of the
/// whole do after all steps. That is the first step, where places are those of the files; or, since
/// it sorts points anew, one that makes a point of each cell. Nothing if they are not known after
/// the last step: one of them does not say what it does to the order, or the cells are too many.
template <Scalar S, int D>
std::optional<std::size_t> first_with_places(const tile_survey<D>& survey,
                                             std::span<const tile_step<S, D>> steps);

/// Numbers the points that go into a step that makes one of each cell, by their cells.
template <Scalar S, int D>
void set_places_by_cell(point_cloud<S, D>& cloud, const tile_survey<D>& survey,
                        const cell_layout_of<D>& cells);
/// Notes places with the points, as an attribute: what chooses points takes it along, and where a
/// cell becomes a point, all have the same number.
template <Scalar S, int D>
void set_places(point_cloud<S, D>& cloud, std::vector<std::uint64_t> places);

/// What was noted, if anything was, and forgetting it.
template <Scalar S, int D>
std::span<const std::uint64_t> places_of(const point_cloud<S, D>& cloud);
template <Scalar S, int D>
void drop_places(point_cloud<S, D>& cloud);

/// Turns what files of points do not hold to the last bit, places and colours, into numbers that
/// they do. Throws `invalid_input` if places do not ascend.
template <Scalar S, int D>
void put_aside(point_cloud<S, D>& cloud);
/// Puts points that have been put aside with their places into an order in which those that other
/// tiles read follow each other: parts that are up to `border` away from a side of the tile or
/// from two, and the rest. Returns where these end.
template <Scalar S, int D>
std::vector<index_t> sort_by_border(point_cloud<S, D>& cloud, const tile_info& tile, double edge,
                                    double border);
/// Undoes `put_aside`, and returns the places; none if there were none.
template <Scalar S, int D>
std::vector<std::uint64_t> take_back(point_cloud<S, D>& cloud);

}  // namespace cilantro
