// SPDX-License-Identifier: MIT
export module cilantro.io:posed_scan;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;
import cilantro.cloud;

namespace cilantro {

/// A scan as its scanner saw it, and where that stood.
export template <Scalar S>
struct posed_scan {
  std::string name = {};         ///< As the file calls it; may be empty.
  point_cloud<S, 3> cloud = {};  ///< Relative to the scanner.
  /// From the scanner's coordinates to those of the world. The scanner stands at its translation.
  Eigen::Affine3d pose = Eigen::Affine3d::Identity();
};

}  // namespace cilantro
