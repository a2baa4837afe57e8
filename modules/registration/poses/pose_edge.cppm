// SPDX-License-Identifier: MIT
export module cilantro.registration:pose_edge;

import cilantro.standard;
import cilantro.core;
import :concepts;
import :icp;

namespace cilantro {

/// The number of unknowns of a rigid motion in D dimensions.
export template <int D>
inline constexpr int pose_unknowns = D * (D + 1) / 2;

/// The information of an edge: one row and column per unknown.
export template <int D>
using pose_information = Eigen::Matrix<double, pose_unknowns<D>, pose_unknowns<D>>;

/// An edge of a pose graph, in 2D or 3D: what one measurement says of two nodes. It is what
/// `align(scans[source], scans[target])` finds.
export template <int D>
  requires(D == 2 || D == 3)
struct pose_edge {
  index_t source = -1, target = -1;  ///< The numbers of two different nodes, from 0.
  /// Moves points from the coordinates of `source` into those of `target`.
  rigid_transform<double, D> transform = rigid_transform<double, D>::Identity();
  /// The inverse of the covariance of `transform`, symmetric and positive semidefinite. The
  /// unknowns are those of `alignment_fit::information`: rotation in radians about the target's x,
  /// y and z (in 2D one angle), around the target's origin, then translation. Directions in which
  /// it is 0 are not measured.
  sized<pose_information<D>> information = pose_information<D>::Identity();
  /// Whether the edge is beyond doubt, such as one of an odometry: no robust kernel looks at it,
  /// and it is never rejected.
  bool trusted = false;
};

/// What an alignment does not know of the edge that is made of it.
export struct pose_edge_options {
  index_t source = -1, target = -1;  ///< The nodes whose scans were aligned.
  /// The standard deviation of a residual. By default the `residual` of the fit, but at least a
  /// millionth of the distance of the points from the target's origin, root mean square.
  std::optional<positive> noise = {};
  /// How many of the pairs count as independent measurements; more than there are are all. Errors
  /// of neighbouring points are alike, so that thousands of pairs promise a precision that no scan
  /// has.
  positive independent_pairs = 10;
  bool trusted = false;  ///< As in `pose_edge`.
};

/// The information of a transform with this fit, without what its undetermined directions seem to
/// say.
[[nodiscard]] Eigen::MatrixXd information_of(const alignment_fit& fit,
                                             const pose_edge_options& options);

/// The edge that an alignment has found: `pose_edge_of(align(scans[4], scans[1]), {.source = 4,
/// .target = 1})`. The clouds must have the same origin, or none.
///
/// Its information is Σ w JᵀJ of the fit, divided by the squared noise, times the share of the
/// pairs that count as independent. Directions that the pairs do not determine have none, even
/// where Σ w JᵀJ is not quite 0; nor has an alignment with too few pairs, or one that was
/// cancelled. Throws `invalid_input` if all residuals are 0, no point is off the origin, and no
/// noise is given.
export template <RigidMap T>
  requires(T::Dim == 2 || T::Dim == 3)
[[nodiscard]] pose_edge<T::Dim> pose_edge_of(const icp_result<T>& found,
                                             const pose_edge_options& options) {
  pose_edge<T::Dim> edge{.source = options.source,
                         .target = options.target,
                         .transform = make_transform<rigid_transform<double, T::Dim>>(
                             found.transform.linear(), found.transform.translation()),
                         .trusted = options.trusted};
  const bool says_something =
      found.status != icp_status::too_few_pairs && found.status != icp_status::cancelled;
  edge.information.setZero();
  if (says_something) edge.information = information_of(found, options);
  return edge;
}

/// The same measurement, told from the other side: the transform is inverted, and the information
/// is that about the other node's origin. A pose graph with one or the other has the same result.
export template <int D>
[[nodiscard]] pose_edge<D> reversed(const pose_edge<D>& edge);

/// The poses of `nodes` nodes, from the coordinates of each to the world, by following edges from
/// the lowest node of each component, which is at the identity. Nodes are reached along a spanning
/// tree of the edges that say most: trusted ones first, then by the number of directions that they
/// determine, then by the determinant of their information in these. Edges without information are
/// not followed. Throws what `optimize_poses` throws for such edges. O(edges log edges).
/// Source: Kruskal 1956, "On the shortest spanning subtree of a graph".
export template <int D>
[[nodiscard]] std::vector<rigid_transform<double, D>> poses_from_edges(
    index_t nodes, const std::vector<pose_edge<D>>& edges);

extern template pose_edge<2> reversed(const pose_edge<2>&);
extern template pose_edge<3> reversed(const pose_edge<3>&);
extern template std::vector<rigid_transform<double, 2>> poses_from_edges(
    index_t, const std::vector<pose_edge<2>>&);
extern template std::vector<rigid_transform<double, 3>> poses_from_edges(
    index_t, const std::vector<pose_edge<3>>&);

}  // namespace cilantro
