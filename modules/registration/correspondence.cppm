// SPDX-License-Identifier: MIT
export module cilantro.registration:correspondence;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// A point of the target and a point of the source that are taken to be the same place.
export template <Scalar S>
struct correspondence {
  std::int32_t source = 0, target = 0;  ///< Indices.
  S distance = 0;                       ///< What the search compared by; not squared.
  friend bool operator==(const correspondence&, const correspondence&) = default;
};

/// Pairs by ascending source, then target.
export template <Scalar S>
using correspondences = std::vector<correspondence<S>>;

/// From which side partners are looked for. `both` joins what the two directions find.
export enum class search_direction { source_to_target, target_to_source, both };

/// One of the two sets of points, none, or both.
export enum class sides { none, source, target, both };

/// Which pairs a search yields. The rules apply in the order in which they are listed here, and in
/// the same way whatever the direction.
export struct correspondence_options {
  search_direction direction = search_direction::source_to_target;
  /// 1. Pairs farther apart are dropped; in the units of the distance, not squared.
  double max_distance = std::numeric_limits<double>::infinity();
  /// 2. Whether only pairs stay in which each is the other's nearest: what both directions find.
  bool reciprocal = false;
  /// 3. On which sides a point may be in one pair only: that of the least distance.
  sides one_to_one = sides::none;
  /// 4. The share of the remaining pairs that is kept, those of the least distances; in (0, 1].
  double fraction = 1;
  int threads = 0;
};

/// Throws `invalid_input` for a distance that is negative or NaN, or a fraction out of (0, 1].
void expect_valid(const correspondence_options& options);

/// Applies rules 1, 3 and 4 of the options to `pairs`, which are left in order of source, then
/// target. Pairs of the same distance are told apart by source, then target. O(n log n).
/// Throws `invalid_input` for options that make no sense.
export template <Scalar S>
void select_correspondences(correspondences<S>& pairs, const correspondence_options& options);

extern template void select_correspondences(correspondences<float>&, const correspondence_options&);
extern template void select_correspondences(correspondences<double>&,
                                            const correspondence_options&);

}  // namespace cilantro
