// SPDX-License-Identifier: MIT
export module cilantro.registration:surface;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;

namespace cilantro {

/// Points, and the normals of the surface that they lie on where those are known. Owns nothing.
export template <Scalar S, int D>
struct surface_view {
  using scalar = S;
  static constexpr int static_dimension = D;

  points_view<S, D> points;
  points_view<S, D> normals;  ///< One a point, unit length or zero if unknown; or none at all.

  surface_view() = default;
  /// Throws `invalid_input` unless there is one normal a point, or none, and of their dimension.
  explicit surface_view(points_view<S, D> places, points_view<S, D> directions = {})
      : points{places}, normals{directions} {
    expects(normals.empty() || normals.size() == points.size(),
            "surface_view: there must be one normal a point, or none");
    expects(normals.empty() || normals.dimension() == points.dimension(),
            "surface_view: points and normals differ in dimension");
  }

  [[nodiscard]] bool has_normals() const { return !normals.empty(); }
};

/// Throws `invalid_input`, naming the surface, if a normal is neither of unit length, to one part
/// in a hundred, nor zero or not finite, which means unknown: residuals along it would be of
/// another unit.
template <Scalar S, int D>
void expect_unit_length(points_view<S, D> normals, const char* whose) {
  for (index_t i = 0; i < normals.size(); ++i) {
    const double square = normals[i].template cast<double>().squaredNorm();
    if (square != 0 && std::isfinite(square) && !(square > 0.98 && square < 1.02))
      throw invalid_input{"registration: normals must have unit length, and normal " +
                          std::to_string(i) + " of the " + whose + " has a length of " +
                          in_digits(std::sqrt(square))};
  }
}

template <class T>
inline constexpr bool is_surface_view = false;
template <Scalar S, int D>
inline constexpr bool is_surface_view<surface_view<S, D>> = true;

/// What can be registered: points of any kind, a cloud, or points with normals.
export template <class T>
concept SurfaceSource = PointsSource<T> || PointCloud<T> || is_surface_view<std::remove_cvref_t<T>>;

/// The surface that `source` is, for as long as its storage lives.
template <SurfaceSource T>
[[nodiscard]] auto surface_in(const T& source) {
  if constexpr (is_surface_view<T>) {
    return source;
  } else if constexpr (PointCloud<T>) {
    return surface_view<typename T::scalar, T::static_dimension>{points_in(source.points),
                                                                 points_in(source.normals)};
  } else {
    const auto points = points_in(source);
    return surface_view<scalar_of<T>, dimension_of<T>>{points};
  }
}

/// A surface that may be looked at after the call: not a temporary that takes its storage with it.
export template <class T>
concept BorrowedSurface =
    SurfaceSource<T> &&
    (BorrowedPoints<T> || is_surface_view<std::remove_cvref_t<T>> || std::is_lvalue_reference_v<T>);

/// The surface that `source` is: its points, and its normals if it has some. As for `as_points`,
/// temporaries that own their points are refused.
export template <BorrowedSurface T>
[[nodiscard]] auto as_surface(T&& source) {
  return surface_in(static_cast<const std::remove_cvref_t<T>&>(source));
}
/// Points with these normals. Throws `invalid_input` unless there is one normal a point.
export template <BorrowedPoints P, BorrowedPoints N>
[[nodiscard]] auto as_surface(P&& points, N&& normals) {
  return surface_view<scalar_of<P>, dimension_of<P>>{as_points(std::forward<P>(points)),
                                                     as_points(std::forward<N>(normals))};
}

export template <SurfaceSource T>
using surface_view_of = decltype(surface_in(std::declval<const std::remove_cvref_t<T>&>()));

}  // namespace cilantro
