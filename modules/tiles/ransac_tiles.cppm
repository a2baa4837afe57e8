// SPDX-License-Identifier: MIT
export module cilantro.tiles:ransac_tiles;

import cilantro.standard;
import cilantro.core;
import cilantro.geometry;
import cilantro.cloud;
import cilantro.consensus;
import :tiled_cloud;

namespace cilantro {

/// The plane that `ransac_hyperplane` finds in a survey.
export template <int D>
struct survey_plane {
  hyperplane_model<D> model;  ///< Relative to the origin of the survey.
  index_t inliers = 0;        ///< How many points agree with it.
  double score = 0;           ///< By the chosen score, over all points.
  double rmse = 0;            ///< Root mean square of the distances of the inliers.
  index_t iterations = 0;     ///< The number of samples drawn for the best plane.
};

/// The plane, in 2D the line, that most points of a survey agree with, after its steps; nothing if
/// no plane has enough of them.
///
/// Planes are looked for among 50,000 points, which a hash of their coordinates and the seed
/// chooses: eight by samples of D of these, and eight by samples of one and the nine nearest to it,
/// by `sequential_ransac` with these options. All points decide which is the best, in one pass, and
/// by its inliers it is refitted, in one more each. Sums are exact, so that it has the same bits
/// for any tiles, threads and ranks. For a second plane, drop the inliers of the first, as by
/// `with_reach(0, …)`.
///
/// With the default 1000 samples, a plane is missed once in a thousand times if it has 0.7 % of the
/// points that are left of those of the larger planes, and lies so that points of the 50,000 have
/// their nearest ones on it, too; if it is buried among others everywhere, if it has 19 % of them
/// (8 % in 2D). For a share p, `.max_iterations` must be 7/p, or 7/p³ (7/p²). Below 0.1 %, 50 of
/// the 50,000 points, crop first.
///
/// `.max_residual`, `.score`, `.min_inliers` and `.refit` are of all points; the other options of
/// the search among those chosen. Throws `invalid_input` for options that make no sense, and for
/// `.threads`, which are those of `open_tiles`; what reading and steps throw; and `cancelled`.
/// Source: as in `ransac` and `hyperplane_family`.
export template <Scalar S, int D>
[[nodiscard]] std::optional<survey_plane<D>> ransac_hyperplane(const tiled_cloud<S, D>& cloud,
                                                               const ransac_options& options);

}  // namespace cilantro
