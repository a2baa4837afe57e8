// SPDX-License-Identifier: MIT
//
// How families read points. Internal.
export module cilantro.consensus:sample;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// Some points in double, one per column, relative to `origin`, which is the first of them; nothing
/// if one is not finite.
struct gathered_points {
  Eigen::MatrixXd points;
  Eigen::VectorXd origin;
};
template <Scalar S, int D>
std::optional<gathered_points> gather_points(points_view<S, D> points,
                                             std::span<const std::int32_t> indices);

/// A length is negligible if its ratio to another is below this, for coordinates in S and for what
/// is computed from them.
template <Scalar S>
inline constexpr double negligible_ratio = 16 * double(std::numeric_limits<S>::epsilon());

/// Mean, principal directions and their variances, ascending; nothing if a point is not finite.
struct principal_frame {
  Eigen::VectorXd mean;
  Eigen::MatrixXd axes;
  Eigen::VectorXd variances;
};
template <Scalar S, int D>
std::optional<principal_frame> frame_of(points_view<S, D> points,
                                        std::span<const std::int32_t> indices);

}  // namespace cilantro
