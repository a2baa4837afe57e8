// SPDX-License-Identifier: MIT
//
// Parts of space, defined by the points that they contain.
export module cilantro.geometry:region;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// A part of space of dimension D: a struct with `contains(point)`, or a predicate. The point is in
/// double and in world coordinates.
///
/// Semantics: pure, and called from several threads at once. It is never called for a point that is
/// not finite. Optional: `check(dimension)` throws `invalid_input` for a region that makes no
/// sense, or not for points of that dimension; it is called once, before `contains`. And
/// `mark_inside(points, origin, inside)` answers for many points at once: `points` is a
/// `points_view` of float or double of run-time dimension, to which the vector `origin` is added,
/// and `inside` a span of one `std::uint8_t` for each, which becomes 1 if the point is finite and
/// inside, and otherwise 0.
/// Models: `box`, `ball`, `cylinder`, `half_space`, `half_spaces`; `convex_polytope`,
/// `space_region`; a lambda.
export template <class R, int D>
concept Region = requires(const R& region, const point_vector<double, D>& point) {
  { region.contains(point) } -> std::convertible_to<bool>;
} || std::predicate<const R&, const point_vector<double, D>&>;

/// Whether `region` contains `point`.
export template <int D, Region<D> R>
[[nodiscard]] bool is_inside(const R& region, const point_vector<double, D>& point) {
  if constexpr (requires { region.contains(point); })
    return region.contains(point);
  else
    return std::invoke(region, point);
}

/// The points from corner `lower` to the opposite corner `upper`, both included, in any dimension:
/// `box{.lower = {0, 0, 0}, .upper = {1, 1, 2}}`.
export struct box {
  coordinates lower, upper;

  /// Throws `invalid_input` for corners of another dimension, for NaN, and unless `lower` is at
  /// most `upper` in each coordinate.
  void check(index_t dimension) const {
    expects(lower.size() == dimension && upper.size() == dimension,
            "box: the corners must have the dimension of the points");
    for (index_t d = 0; d < dimension; ++d)
      expects(lower[d] <= upper[d], "box: lower must be at most upper in each coordinate");
  }
  template <class P>
  [[nodiscard]] bool contains(const P& point) const {
    expect_coordinates(point.size(), lower.size());
    for (index_t d = 0; d < point.size(); ++d)
      if (!(lower[d] <= point[d] && point[d] <= upper[d])) return false;
    return true;
  }
};

/// The points at most `radius` away from `center`, in any dimension.
export struct ball {
  coordinates center;
  positive radius;

  /// Throws `invalid_input` for a centre of another dimension.
  void check(index_t dimension) const {
    expects(center.size() == dimension, "ball: the center must have the dimension of the points");
  }
  template <class P>
  [[nodiscard]] bool contains(const P& point) const {
    expect_coordinates(point.size(), center.size());
    double sum = 0;
    for (index_t d = 0; d < point.size(); ++d)
      sum += (point[d] - center[d]) * (point[d] - center[d]);
    return sum <= radius * radius;
  }
};

/// The solid right circular cylinder between two discs: the points at most `radius` away from the
/// line through `base` and `top`, between the planes through these across it, both included. In
/// any dimension; in 2D it is a rectangle.
/// `cylinder{.base = {0, 0, 0}, .top = {0, 0, 2}, .radius = 0.3}` stands upright.
export struct cylinder {
  coordinates base, top;  ///< The centres of the discs at its ends, in either order.
  positive radius;

  /// Throws `invalid_input` for centres of another dimension, for NaN and infinity, and for centres
  /// that are equal, since they say no direction; or so near or so far apart that the square of
  /// their distance is no number.
  void check(index_t dimension) const {
    expects(base.size() == dimension && top.size() == dimension,
            "cylinder: base and top must have the dimension of the points");
    double length = 0;
    for (index_t d = 0; d < dimension; ++d) length += (top[d] - base[d]) * (top[d] - base[d]);
    expects(length >= std::numeric_limits<double>::min() && std::isfinite(length),
            "cylinder: base and top must be finite, and apart");
  }
  template <class P>
  [[nodiscard]] bool contains(const P& point) const {
    expect_coordinates(point.size(), base.size());
    double along = 0, length = 0;
    for (index_t d = 0; d < point.size(); ++d) {
      const double axis = top[d] - base[d];
      along += (point[d] - base[d]) * axis;
      length += axis * axis;
    }
    if (!(0 <= along && along <= length)) return false;
    // From the nearest point of the axis: a difference of squares would lose thin and long ones.
    double away = 0;
    for (index_t d = 0; d < point.size(); ++d) {
      const double across = point[d] - base[d] - along / length * (top[d] - base[d]);
      away += across * across;
    }
    return away <= radius * radius;
  }
};

/// The points p with normal · p <= offset.
export struct half_space {
  coordinates normal;  ///< Of any length but 0; it points out of the half-space.
  double offset;       ///< In the units of the points if the normal has unit length.

  /// Throws `invalid_input` for a normal of another dimension or of zeros, and for NaN.
  void check(index_t dimension) const {
    expects(normal.size() == dimension,
            "half_space: the normal must have the dimension of the points");
    double sum = 0;
    for (index_t d = 0; d < dimension; ++d) sum += std::abs(normal[d]);
    expects(sum > 0 && std::isfinite(sum) && !std::isnan(offset),
            "half_space: normal and offset must be numbers, and the normal not zero");
  }
  template <class P>
  [[nodiscard]] bool contains(const P& point) const {
    expect_coordinates(point.size(), normal.size());
    double sum = 0;
    for (index_t d = 0; d < point.size(); ++d) sum += normal[d] * point[d];
    return sum <= offset;
  }
};

/// The intersection of half-spaces, such as a convex polytope; all of space if there are none.
export struct half_spaces {
  std::vector<half_space> all;  ///< The half-spaces.

  /// Throws `invalid_input` as `half_space::check` does.
  void check(index_t dimension) const {
    for (const auto& one : all) one.check(dimension);
  }
  template <class P>
  [[nodiscard]] bool contains(const P& point) const {
    return std::ranges::all_of(all, [&](const auto& one) { return one.contains(point); });
  }
};

}  // namespace cilantro
