// SPDX-License-Identifier: MIT
export module cilantro.io:file_options;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// How readers treat coordinates that a cloud's scalar would round, such as those of maps.
export enum class origin_policy {
  /// If more than a tenth of the points have a coordinate of 10,000 or more that float cannot
  /// represent exactly (for text, to all its digits), their median, rounded to whole numbers, is
  /// subtracted in double, and becomes the cloud's origin. An origin that a writer of this library
  /// has noted in the file is always used.
  automatic,
  none,  ///< Coordinates are rounded, and the origin is zero.
};

/// Options of `read_cloud`, `read_ply` and `read_pcd`.
export struct read_options {
  origin_policy origin = origin_policy::automatic;  ///< Whether large coordinates get an origin.
  int threads = 0;  ///< How many read the numbers of a text: see `execution`.
  task_monitor monitor = {};
};

}  // namespace cilantro
