// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
export module cilantro.features:iss_keypoints;

import cilantro.standard;
import cilantro.core;
import cilantro.search;

namespace cilantro {

/// Options of `iss_keypoints`.
export struct iss_options {
  /// Of the neighbourhood in which the points must vary differently in all directions, in the units
  /// of the points; usually six times their spacing. Required.
  double radius = 0;
  /// Of two keypoints this close, the more salient one is kept; by default, two thirds of `radius`.
  std::optional<double> suppression = {};
  /// Each variance is at most this share of the next larger one, in (0, 1]: a flat or round
  /// neighbourhood fixes no directions.
  double most_alike = 0.975;
  index_t min_neighbors = 5;  ///< With fewer neighbours, the point among them, it is no keypoint.
  int threads = 0;
  task_monitor monitor = {};
};

template <Scalar S, int D>
index_list closed_iss_keypoints(points_view<S, D> points, const iss_options& options);

/// Points whose neighbourhood varies in all directions, and in each to another degree, so that
/// features there say where they are: intrinsic shape signatures. Their indices, ascending.
///
/// The saliency of a point is the smallest variance of its neighbourhood; of several within
/// `suppression` the most salient one is kept, and of equal ones the first. In any dimension.
/// Points that are not finite are none. Throws `invalid_input` for options that make no sense. O(N
/// k D²); the same bits for any number of threads.
/// Source: Zhong 2009, "Intrinsic shape signatures: a shape descriptor for 3D object recognition",
/// section 3.
export template <PointsSource P>
[[nodiscard]] index_list iss_keypoints(const P& points, const iss_options& options) {
  return closed_iss_keypoints(closed_points(points), options);
}

}  // namespace cilantro
