// SPDX-License-Identifier: MIT
export module cilantro.geometry:orientation;

import cilantro.standard;
import cilantro.core;
import cilantro.search;

namespace cilantro {

template <Scalar S, int D>
index_t closed_orient_consistently(points_view<S, D> points, const neighborhoods<S>& graph,
                                   const point_vector<S, D>* viewpoint, S* normals, index_t stride);

export struct orientation_options {
  /// Each connected part of the surface is turned so that the normal nearest to this point points
  /// towards it. Without one, so that the normal of the point that is highest along the last axis
  /// points up.
  std::optional<coordinates> viewpoint = {};
};

/// Turns normals, in place, so that neighbours agree over the whole surface: along a minimum
/// spanning tree of a neighbour graph, whose edges cost 1 − |nᵢ · nⱼ|, so that the sides are
/// carried over flat places and not over edges. Returns the number of connected parts.
///
/// The graph is made symmetric. Zero normals, which stand for unknown ones, stay zero and carry
/// nothing. Throws `invalid_input` for mismatched sizes. O(E log E).
/// Source: Hoppe et al. 1992, section 3.3.
export template <PointsSource P, class N>
  requires std::same_as<points_view_of<N>, points_view_of<P>>
index_t orient_consistently(Eigen::MatrixBase<N>& normals, const P& points,
                            const neighborhoods<scalar_of<P>>& graph,
                            const orientation_options& options = {}) {
  using S = scalar_of<P>;
  constexpr int C = closed_dimension<dimension_of<P>>;
  const points_view<S, C> view = points_in(points);
  expects(normals.rows() == view.dimension() && normals.cols() == view.size(),
          "orient_consistently: there must be one normal per point");
  point_vector<S, C> eye;
  if (options.viewpoint)
    eye = options.viewpoint->as<S, C>(
        view.dimension(),
        "orient_consistently: the viewpoint must have the dimension of the points");
  return closed_orient_consistently<S, C>(view, graph, options.viewpoint ? &eye : nullptr,
                                          normals.derived().data(),
                                          normals.derived().outerStride());
}

/// As above, through the graph of the neighbours that `spec` says.
export template <PointsSource P, class N>
  requires std::same_as<points_view_of<N>, points_view_of<P>>
index_t orient_consistently(Eigen::MatrixBase<N>& normals, const P& points, neighborhood_spec spec,
                            const orientation_options& options = {}) {
  return orient_consistently(normals, points, neighbor_graph(points, spec), options);
}

}  // namespace cilantro
