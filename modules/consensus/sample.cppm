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

/// Two lengths whose ratio is below this are as good as one: of coordinates in S, and of what has
/// been computed from them.
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
