// SPDX-License-Identifier: MIT
//
// How families look at points. Internal.
export module cilantro.model:data;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;

namespace cilantro {

/// Points, or the points of a cloud, that a family may look at after the call.
export template <class T>
concept BorrowedData = BorrowedPoints<T> || (PointCloud<T> && std::is_lvalue_reference_v<T>);

template <BorrowedData T>
[[nodiscard]] auto data_in(T&& source) {
  if constexpr (PointCloud<T>)
    return as_points(source.points);
  else
    return as_points(std::forward<T>(source));
}
template <BorrowedData T>
using data_view_of = decltype(data_in(std::declval<T>()));

/// Some points in double, one a column, relative to `origin`, which is the first of them; nothing
/// if one is not finite.
struct gathered_points {
  Eigen::MatrixXd points;
  Eigen::VectorXd origin;
};
template <Scalar S, int D>
std::optional<gathered_points> gather_points(points_view<S, D> points,
                                             std::span<const index_t> indices);

/// Two lengths whose ratio is below this are as good as one: of coordinates in S, and of what has
/// been computed from them.
template <Scalar S>
inline constexpr double negligible_ratio = 16 * double(std::numeric_limits<S>::epsilon());

/// Mean, principal directions and their variances, ascending.
struct principal_frame {
  Eigen::VectorXd mean;
  Eigen::MatrixXd axes;
  Eigen::VectorXd variances;
};
[[nodiscard]] principal_frame frame_of(const gathered_points& data);

}  // namespace cilantro
