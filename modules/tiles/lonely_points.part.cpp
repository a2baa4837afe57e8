// SPDX-License-Identifier: MIT
//
// Points that have few others near them, found without a tree. Internal.
module cilantro.tiles:lonely_points;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// The points that have not certainly `needed` points, itself among them, within what `known(i)`
/// says is known around them; that is asked for some points only, at least `distance` for all, and
/// negative for those that nobody asks about. Among the result are some that have them, but beyond
/// 2 · `distance`.
template <Scalar S, int D>
index_list lonely_points(const point_matrix<S, D>& points, double distance, index_t needed,
                         const std::function<double(std::int32_t)>& known);

/// How far each of some points is from the last of the `needed` points that are nearest to it,
/// itself among them. Precondition: there are so many points.
template <Scalar S, int D>
std::vector<S> farthest_of_nearest(const point_matrix<S, D>& points, const index_list& of,
                                   index_t needed);

}  // namespace cilantro
