// SPDX-License-Identifier: MIT
export module cilantro.io:file_options;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// What is done with coordinates that a cloud's scalar would round, such as those of maps.
export enum class origin_policy {
  /// If more than a tenth of the points have a coordinate of 10,000 or more, and float does not
  /// hold those (to the bit; of a text, to its digits), their median in whole numbers is subtracted
  /// in
  /// double, and kept as the cloud's origin. An origin that a writer of this library has noted in
  /// the file is taken in any case.
  automatic,
  none,  ///< They are rounded, and the origin is zero.
};

/// What all readers of clouds ask.
export struct read_options {
  origin_policy origin = origin_policy::automatic;
  task_monitor monitor = {};
};

}  // namespace cilantro
