// SPDX-License-Identifier: MIT
export module cilantro.registration:correspondence;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// A source point and a target point that are assumed to be the same place.
export template <Scalar S>
struct correspondence {
  std::int32_t source = 0, target = 0;  ///< Indices.
  S distance = 0;  ///< The distance by which the search has compared; not squared.
  friend bool operator==(const correspondence&, const correspondence&) = default;
};

/// Pairs by ascending source, then target.
export template <Scalar S>
using correspondences = std::vector<correspondence<S>>;

/// From which side partners are searched: for each source point in the target (`source_to_target`),
/// for each target point in the source (`target_to_source`), or `both`, which joins the pairs of
/// the two directions.
export enum class search_direction { source_to_target, target_to_source, both };

/// One of the two sets of points, none, or both.
export enum class sides { none, source, target, both };

/// Which pairs a search returns. The numbered rules apply in this order, and in the same way for
/// all directions.
export struct correspondence_options {
  /// Which points look for a partner.
  search_direction direction = search_direction::source_to_target;
  /// 1. Pairs farther apart than this are dropped; in the units of the distance, not squared.
  double max_distance = std::numeric_limits<double>::infinity();
  /// 2. Whether only pairs are kept in which each point is the other's nearest, so that both
  /// directions find them.
  bool reciprocal = false;
  /// 3. On these sides, each point is kept in one pair only: that of the smallest distance.
  sides one_to_one = sides::none;
  /// 4. The share of the remaining pairs that is kept, those of the smallest distances; in (0, 1].
  double fraction = 1;
  int threads = 0;
};

/// Throws `invalid_input` for a distance that is negative or NaN, or a fraction out of (0, 1].
void expect_valid(const correspondence_options& options);

/// Applies rules 1, 3 and 4 of the options to `pairs`, and sorts them by source, then target. Among
/// pairs of equal distance, the first in this order is preferred. O(n log n). Throws
/// `invalid_input` for options that make no sense.
export template <Scalar S>
void select_correspondences(correspondences<S>& pairs, const correspondence_options& options);

extern template void select_correspondences(correspondences<float>&, const correspondence_options&);
extern template void select_correspondences(correspondences<double>&,
                                            const correspondence_options&);

}  // namespace cilantro
