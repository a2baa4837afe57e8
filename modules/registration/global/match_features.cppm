// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
export module cilantro.registration:match_features;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :correspondence;

namespace cilantro {

/// Options of `match_features`.
export struct match_options {
  /// Whether only pairs are kept in which each feature is the other's nearest.
  bool mutual = true;
  /// A pair is kept if its distance is at most this share of that to the second nearest target, in
  /// (0, 1]; below 1, features that occur more than once match nothing.
  double ratio = 1;
  /// Features farther apart than this are never paired.
  double max_distance = std::numeric_limits<double>::infinity();
  int threads = 0;
  task_monitor monitor = {};
};

template <Scalar S>
correspondences<S> closed_match_features(points_view<S, dynamic> source,
                                         points_view<S, dynamic> target,
                                         const match_options& options);

/// Pairs points by what they look like: each source feature with the nearest target feature.
///
/// Features are columns, of any number of coordinates: of `fpfh`, or your own. A feature that is
/// all zeros or not finite is unknown, and in no pair. The `distance` of a pair is the Euclidean
/// one of the features. Features that are histograms are told apart better by their square roots
/// (Hellinger's distance): `match_features(a.cwiseSqrt().eval(), b.cwiseSqrt().eval())`.
///
/// Throws `invalid_input` for features of different dimension, and for options that make no sense.
/// O(M N Dim), by products of matrices; the same bits for any number of threads.
export template <PointsSource A, PointsSource B>
  requires std::same_as<scalar_of<A>, scalar_of<B>>
[[nodiscard]] auto match_features(const A& source_features, const B& target_features,
                                  const match_options& options = {}) {
  using S = scalar_of<A>;
  return closed_match_features<S>(points_view<S, dynamic>{points_in(source_features)},
                                  points_view<S, dynamic>{points_in(target_features)}, options);
}

}  // namespace cilantro
