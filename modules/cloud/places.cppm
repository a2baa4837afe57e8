// SPDX-License-Identifier: MIT
//
// Points of any kind, or a cloud, which stands for its points: for algorithms that look at nothing
// else of it.
export module cilantro.cloud:places;

import cilantro.standard;
import cilantro.core;
import :point_cloud;

namespace cilantro {

export template <class T>
concept PointsOrCloud = PointsSource<T> || PointCloud<T>;

/// Their view for the length of a call, also of a temporary.
export template <PointsOrCloud T>
[[nodiscard]] auto places_in(const T& source) {
  if constexpr (PointCloud<T>)
    return points_in(source.points);
  else
    return points_in(source);
}
export template <PointsOrCloud T>
using places_view_of = decltype(places_in(std::declval<const std::remove_cvref_t<T>&>()));

/// Points or a cloud that may be looked at after the call: not a temporary that takes its storage
/// with it.
export template <class T>
concept BorrowedPlaces = BorrowedPoints<T> || (PointCloud<T> && std::is_lvalue_reference_v<T>);

export template <BorrowedPlaces T>
[[nodiscard]] auto as_places(T&& source) {
  return places_in(static_cast<const std::remove_cvref_t<T>&>(source));
}

}  // namespace cilantro
