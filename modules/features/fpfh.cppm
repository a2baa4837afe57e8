// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
export module cilantro.features:fpfh;

import cilantro.standard;
import cilantro.core;
import cilantro.search;

namespace cilantro {

/// The number of bins of each histogram of `fpfh`.
export inline constexpr index_t fpfh_bins = 11;

/// Options of `fpfh`.
export struct fpfh_options {
  /// The points that get a feature, in this order; by default, all.
  std::optional<index_list> at = {};
  /// Whether the signs of normals mean something, as after `orient_to_viewpoint`: hollows are then
  /// told from bumps. Otherwise features do not depend on the signs, which `estimate_normals`
  /// chooses without a viewpoint.
  bool oriented = false;
  int threads = 0;
  task_monitor monitor = {};
};

template <Scalar S, int D>
Eigen::MatrixXf closed_fpfh(points_view<S, D> points, points_view<S, D> normals,
                            const neighborhood_spec& near, const fpfh_options& options);

/// Fast point feature histograms: how the normals in the neighbourhood of each point are turned
/// against one another, which no rigid motion changes.
///
/// One column per point: in 3D `33 × N`, histograms of the angles θ, α and φ of 11 bins each; in 2D
/// `22 × N`, those of θ and φ. Each histogram has a sum of 1: half of it is the histogram of the
/// pairs that the point forms with its neighbours, half the mean of those of its neighbours,
/// weighted by 1 / distance². (200 times as much is what Open3D computes from oriented normals.) A
/// point without a normal or neighbours has a feature of zeros, which `match_features` matches with
/// nothing. Points at the same place are not neighbours here, nor are those without a normal.
///
/// The radius is usually five times the spacing of the points. Throws `invalid_input` unless
/// there is one normal per point, of unit length, or zero if unknown; for another dimension than 2
/// or 3; and for an index in `at` that is not one of a point. O(N k); the same bits for any number
/// of threads. Memory beside the result: 144 bytes per point.
/// Source: Rusu, Blodow & Beetz 2009, "Fast point feature histograms (FPFH) for 3D registration",
/// section III. Features that do not depend on signs: the histogram of the flipped surface is
/// mirrored in θ and φ, and of the two the one is chosen in which most neighbours lie on the
/// positive side.
export template <PointsSource P, PointwiseVectors N>
  requires std::same_as<points_view_of<P>, points_view_of<N>>
[[nodiscard]] Eigen::MatrixXf fpfh(const P& points, const N& normals, neighborhood_spec near,
                                   const fpfh_options& options = {}) {
  using S = scalar_of<P>;
  constexpr int C = closed_dimension<dimension_of<P>>;
  return closed_fpfh<S, C>(points_in(points), points_in(normals), near, options);
}

/// As above, of points that have normals, such as a cloud. Throws `invalid_input` if it has none.
export template <OrientedPoints P>
[[nodiscard]] Eigen::MatrixXf fpfh(const P& points, neighborhood_spec near,
                                   const fpfh_options& options = {}) {
  using S = scalar_of<P>;
  constexpr int C = closed_dimension<dimension_of<P>>;
  return closed_fpfh<S, C>(points_in(points), normals_in(points), near, options);
}

}  // namespace cilantro
