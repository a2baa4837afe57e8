// SPDX-License-Identifier: MIT
//
// Points in space that are nearly in a plane, as points of it.
module cilantro.spatial:flat_view;

import cilantro.standard;
import cilantro.core;
import cilantro.eigen;

namespace cilantro {

/// The plane that fits best, and coordinates in it: the point (x, y) is middle + x·u + y·v, and u,
/// v and the normal are a right-handed frame.
struct flat_view {
  Eigen::Vector3d middle, normal, u, v;
  Eigen::Matrix2Xd places;
  double thickness;  ///< How far apart the points are across the plane.
};

/// Throws `invalid_input`, in the name of `who`, if there is no such plane, or none within the
/// tolerance.
flat_view flattened(const Eigen::Matrix3Xd& points, double tolerance, const std::string& who) {
  expects(tolerance > 0 && std::isfinite(tolerance), who + ": the tolerance must be positive");
  const std::string no_plane = who + ": the points do not determine a plane";
  expects(points.cols() >= 3, no_plane);
  flat_view view;
  view.middle = points.rowwise().mean();
  const Eigen::Matrix3Xd arms = points.colwise() - view.middle;
  const auto spread = decompose_symmetric<3>(arms * arms.transpose());
  expects(spread.values[1] > 1e-12 * spread.values[2], no_plane);
  view.normal = spread.vectors.col(0);
  Eigen::Index largest = 0;
  view.normal.cwiseAbs().maxCoeff(&largest);
  if (view.normal[largest] < 0) view.normal = -view.normal;
  view.u = spread.vectors.col(2);
  view.v = view.normal.cross(view.u);
  const Eigen::RowVectorXd heights = view.normal.transpose() * arms;
  const double farthest = heights.cwiseAbs().maxCoeff();
  expects(farthest <= tolerance, who + ": a point is " + in_digits(farthest) +
                                     " away from the plane that fits best, more than the "
                                     "tolerance");
  view.thickness = heights.maxCoeff() - heights.minCoeff();
  view.places.resize(2, arms.cols());
  view.places << view.u.transpose() * arms, view.v.transpose() * arms;
  return view;
}

}  // namespace cilantro
