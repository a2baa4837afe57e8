// SPDX-License-Identifier: MIT
export module cilantro.geometry:orientation;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :normals;

namespace cilantro {

/// `Near` is the graph, or the specification of one.
template <Scalar S, int D, class Near>
index_t closed_orient_consistently(points_view<S, D> points, const Near& near,
                                   const point_vector<S, D>* viewpoint,
                                   mutable_points_view<S, D> normals);

/// Options of `orient_consistently`.
export struct orientation_options {
  /// In each connected part of the surface, the normal nearest to this point is made to point
  /// towards it. Without a viewpoint, the normal of the point that is highest along the last axis
  /// is made to point up.
  std::optional<coordinates> viewpoint = {};
};

/// Flips normals, in place, so that neighbours agree over the whole surface: follows a minimum
/// spanning tree of a neighbour graph whose edges cost 1 − |nᵢ · nⱼ|, so that orientation spreads
/// across flat regions rather than across sharp edges. Returns the number of connected parts.
///
/// `near` is a specification, or neighbourhoods of the points, whose edges count in both
/// directions. Zero normals, which stand for unknown ones, stay zero, and nothing spreads across
/// them. Throws `invalid_input` for mismatched sizes, for normals that are neither of unit
/// length nor zero, and for a neighbour that is not one of the
/// points. O(E log E); memory: about 12 bytes per edge and 30 per point.
/// Source: Hoppe et al. 1992, section 3.3.
export template <MutablePoints N, PointsSource P, class Near>
  requires std::same_as<points_view_of<N>, points_view_of<P>> &&
           (std::convertible_to<const Near&, neighborhood_spec> ||
            std::same_as<Near, neighborhoods<scalar_of<P>>>)
index_t orient_consistently(N&& normals, const P& points, const Near& near,
                            const orientation_options& options = {}) {
  using S = scalar_of<P>;
  using near_type =
      std::conditional_t<std::same_as<Near, neighborhoods<S>>, neighborhoods<S>, neighborhood_spec>;
  constexpr int C = closed_dimension<dimension_of<P>>;
  const points_view<S, C> view = points_in(points);
  const mutable_points_view<S, C> out = mutable_points_in(normals);
  expects(out.dimension() == view.dimension() && out.size() == view.size(),
          "orient_consistently: there must be one normal per point");
  point_vector<S, C> eye;
  if (options.viewpoint) {
    expect_local(points, "orient_consistently");
    eye = options.viewpoint->as<S, C>(
        view.dimension(),
        "orient_consistently: the viewpoint must have the dimension of the points");
    expects(is_finite(eye), "orient_consistently: the viewpoint must be finite");
  }
  expect_unit_length<S, C>(out, "orient_consistently");
  return closed_orient_consistently<S, C, near_type>(view, near, options.viewpoint ? &eye : nullptr,
                                                     out);
}

}  // namespace cilantro
