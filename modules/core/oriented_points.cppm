// SPDX-License-Identifier: MIT
//
// What points of any kind may have besides: normals, and an origin of their coordinates.
export module cilantro.core:oriented_points;

import cilantro.standard;
import cilantro.eigen;
import :error;
import :points;

namespace cilantro {

/// Points whose type says their normals, too: clouds, `oriented_points_view`, and any type whose
/// `points_traits` have `normals`.
export template <class T>
concept OrientedPoints = PointsSource<T> && requires(const std::remove_cvref_t<T>& source) {
  {
    points_traits<std::remove_cvref_t<T>>::normals(source)
  } -> std::convertible_to<points_view_of<T>>;
};

/// The normals of points of any kind for the length of a call, none where their type says none.
export template <PointsSource T>
[[nodiscard]] auto normals_in(const T& source) -> points_view_of<T> {
  if constexpr (OrientedPoints<T>)
    return points_traits<T>::normals(source);
  else
    return {};
}

/// Where the coordinates of points of any kind begin in the world: zero where their type says none.
export template <PointsSource T>
[[nodiscard]] auto origin_in(const T& source) -> point_vector<double, dimension_of<T>> {
  if constexpr (requires { points_traits<T>::origin(source); })
    return points_traits<T>::origin(source);
  else
    return point_vector<double, dimension_of<T>>::Zero(points_in(source).dimension());
}

/// Points, and their normals where those are known. Owns nothing.
export template <Scalar S, int D>
struct oriented_points_view {
  points_view<S, D> points;
  points_view<S, D> normals;  ///< One a point, unit length or zero if unknown; or none at all.

  oriented_points_view() = default;
  /// Points of any kind, with the normals that they have. Temporaries that own them are refused.
  template <BorrowedPoints P>
  explicit oriented_points_view(P&& source)
      : oriented_points_view{as_points(source), normals_in(source)} {}
  /// Throws `invalid_input` unless there is one normal a point, or none, and of their dimension.
  template <BorrowedPoints P, BorrowedPoints N>
  oriented_points_view(P&& where, N&& directions)
      : points{as_points(std::forward<P>(where))}, normals{as_points(std::forward<N>(directions))} {
    expects(normals.empty() || normals.size() == points.size(),
            "oriented_points_view: there must be one normal a point, or none");
    expects(normals.empty() || normals.dimension() == points.dimension(),
            "oriented_points_view: points and normals differ in dimension");
  }

  [[nodiscard]] bool has_normals() const { return !normals.empty(); }
};
export template <BorrowedPoints P>
oriented_points_view(P&&) -> oriented_points_view<scalar_of<P>, dimension_of<P>>;
export template <BorrowedPoints P, BorrowedPoints N>
oriented_points_view(P&&, N&&) -> oriented_points_view<scalar_of<P>, dimension_of<P>>;

template <Scalar S, int D>
struct points_traits<oriented_points_view<S, D>> {
  static auto view(const oriented_points_view<S, D>& v) { return v.points; }
  static auto normals(const oriented_points_view<S, D>& v) { return v.normals; }
};
template <Scalar S, int D>
inline constexpr bool enable_borrowed_points<oriented_points_view<S, D>> = true;

/// Points of any kind with the normals that they have, for the length of a call.
export template <PointsSource T>
[[nodiscard]] auto oriented_points_in(const T& source) {
  return oriented_points_view<scalar_of<T>, dimension_of<T>>{source};
}

}  // namespace cilantro
