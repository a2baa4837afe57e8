// SPDX-License-Identifier: MIT
//
// What an E57 file holds. Internal.
module;
#include "io/common/number.hpp"
#include "io/common/random_bytes.hpp"
module cilantro.io:e57_scan;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// A value of the points of a scan, under the name of the attribute that it becomes.
struct e57_column {
  std::string name;
  detail::number type = detail::number::float64;
  std::vector<double> values;
};

/// The valid points of a scan.
struct e57_scan {
  std::string name;
  Eigen::Affine3d pose = Eigen::Affine3d::Identity();
  Eigen::Matrix3Xd places;          ///< Relative to the scanner.
  std::vector<e57_column> columns;  ///< Without coordinates; colours from 0 to 1.
};

/// All scans. Throws `detail::failure`.
std::vector<e57_scan> read_e57_data(const detail::random_bytes& file, const task_monitor& monitor);

}  // namespace cilantro
