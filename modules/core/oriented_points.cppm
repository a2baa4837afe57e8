// SPDX-License-Identifier: MIT
//
// What points of any kind may have beside their coordinates: normals, colours, and an origin.
export module cilantro.core:oriented_points;

import cilantro.standard;
import cilantro.eigen;
import :error;
import :points;

namespace cilantro {

/// Points whose type provides normals, too: clouds, `oriented_points_view`, and any type whose
/// `points_traits` have `normals`.
export template <class T>
concept OrientedPoints = PointsSource<T> && requires(const std::remove_cvref_t<T>& source) {
  {
    points_traits<std::remove_cvref_t<T>>::normals(source)
  } -> std::convertible_to<points_view_of<T>>;
};

/// One vector per point, such as normals or colours: a matrix, not a cloud or any other set that
/// has normals of its own.
export template <class T>
concept PointwiseVectors = PointsSource<T> && !OrientedPoints<T>;

/// The normals of points of any kind, for the duration of a call; an empty view if their type has
/// no normals.
export template <PointsSource T>
[[nodiscard]] auto normals_in(const T& source) -> points_view_of<T> {
  if constexpr (OrientedPoints<T>)
    return points_traits<T>::normals(source);
  else
    return {};
}

/// The colours of points of any kind, for the duration of a call: red, green and blue in [0, 1]; an
/// empty view if their type has no colours.
export template <PointsSource T>
[[nodiscard]] auto colors_in(const T& source) -> points_view<float, 3> {
  if constexpr (requires { points_traits<T>::colors(source); })
    return points_traits<T>::colors(source);
  else
    return {};
}

/// The origin of points of any kind: what is added to their coordinates to get world coordinates.
/// Zero if their type has no origin.
export template <PointsSource T>
[[nodiscard]] auto origin_in(const T& source) -> point_vector<double, dimension_of<T>> {
  if constexpr (requires { points_traits<T>::origin(source); })
    return points_traits<T>::origin(source);
  else
    return point_vector<double, dimension_of<T>>::Zero(points_in(source).dimension());
}

/// Throws `invalid_input` if the points have an origin other than zero: this function, `who` in the
/// message, would mix local and world coordinates.
export template <PointsSource T>
void expect_local(const T& points, const char* who) {
  if constexpr (requires { points_traits<T>::origin(points); })
    expects(origin_in(points).isZero(0),
            std::string{who} +
                ": the points have an origin, but this function ignores it; use the function "
                "on clouds, or pass the cloud's .points");
}

/// Throws `invalid_input`, naming the function `who`, if two sets of points have different origins.
export template <PointsSource A, PointsSource B>
void expect_same_origin(const A& a, const B& b, const char* who) {
  expects(points_in(a).empty() || points_in(b).empty() ||
              points_in(a).dimension() != points_in(b).dimension() ||
              (origin_in(a) - origin_in(b)).isZero(0),
          std::string{who} + ": source and target have different origins");
}

/// A view of `points` and, where they are known, their normals. Owns nothing, and has no origin.
export template <Scalar S, int D>
struct oriented_points_view {
  points_view<S, D> points;
  points_view<S, D> normals;  ///< One per point, of unit length, or zero if unknown; or empty.

  oriented_points_view() = default;
  /// Points of any kind, with the normals that they have. Temporaries that own their points do not
  /// compile. Throws `invalid_input` for points with an origin, which would be lost.
  template <BorrowedPoints P>
  explicit oriented_points_view(P&& source)
      : oriented_points_view{as_points(source), normals_in(source)} {
    expect_local(source, "oriented_points_view");
  }
  /// Throws `invalid_input` unless there is one normal per point, or no normal, and the dimensions
  /// agree.
  template <BorrowedPoints P, BorrowedPoints N>
    requires PointwiseVectors<N>
  oriented_points_view(P&& where, N&& directions)
      : points{as_points(std::forward<P>(where))}, normals{as_points(std::forward<N>(directions))} {
    expects(normals.empty() || normals.size() == points.size(),
            "oriented_points_view: there must be one normal per point, or none");
    expects(normals.empty() || normals.dimension() == points.dimension(),
            "oriented_points_view: points and normals differ in dimension");
  }

  /// Whether there are normals.
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

}  // namespace cilantro
