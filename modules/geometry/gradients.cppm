// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
export module cilantro.geometry:gradients;

import cilantro.standard;
import cilantro.core;
import cilantro.search;

namespace cilantro {

/// One number per point: any range of numbers, such as a `std::vector`, a span or an Eigen vector.
export template <class R>
concept PointwiseNumbers = std::ranges::input_range<const R&> &&
                           std::is_arithmetic_v<std::ranges::range_value_t<const R&>>;

/// Numbers in double, and the precision that they had before: a mean of equal colours in single
/// precision may differ from them by its `rounding`.
export struct rounded_values {
  std::vector<double> values;  ///< One per point; NaN where it is not known.
  double rounding = 0;         ///< Relative to the size of the values; 0 for integers.

  /// The numbers with the rounding of their type.
  template <PointwiseNumbers R>
  [[nodiscard]] static rounded_values of(const R& numbers) {
    using T = std::ranges::range_value_t<const R&>;
    rounded_values made;
    if constexpr (std::floating_point<T>) made.rounding = double(std::numeric_limits<T>::epsilon());
    if constexpr (std::ranges::sized_range<const R&>)
      made.values.reserve(std::ranges::size(numbers));
    for (const auto number : numbers) made.values.push_back(static_cast<double>(number));
    return made;
  }
};

template <Scalar S, int D>
[[nodiscard]] point_matrix<S, D> closed_gradients(const oriented_points_view<S, D>& surface,
                                                  std::span<const double> values, double rounding,
                                                  const neighborhood_spec& spec,
                                                  const execution& how);

/// How a value changes along a surface: its gradient in the tangent plane of each point, `Dim × N`,
/// in units of the value per unit of length. `values` has one number per point: an intensity, a
/// temperature, a height. `points` are a cloud with normals, or an `oriented_points_view`.
///
/// Each is the gradient of the linear function that has the point's own value at the point, and
/// fits the values of its neighbours best. Neighbours that spread less than a tenth as far in one
/// direction of the plane as in another, or by no more than the rounding of their coordinates, do
/// not determine the slope in that direction, which is then 0: of points on a line, the gradient
/// along the line is known. A column of NaN says that nothing is known: the point, its value or its
/// normal is not finite or its normal zero, or it has no neighbours in any other place. Neighbours
/// without a finite value are left out; values that differ by no more than their rounding do not
/// differ. So no gradient is longer than 10 √(Dim − 1) times the root of Σ (difference of value)²
/// over Σ (distance in the plane)² of the neighbours.
///
/// Throws `invalid_input` for points without normals, for normals that do not have unit length,
/// unless there is one value per point, and for a specification of fewer than Dim neighbours, the
/// point itself among them. Builds a kd-tree; O(N (log N + k D² + D³)). The same bits for any
/// number of threads. Memory beside the result: the tree, and the neighbourhoods of 256 points per
/// thread. Source: Park, Zhou & Koltun 2017, "Colored point cloud registration revisited": d with
/// d · n = 0 minimises Σ (v(p) + d · (f(q) − p) − v(q))² over the neighbours q, where f projects
/// onto the tangent plane of p; there, without a test of the rank.
export template <OrientedPoints P>
[[nodiscard]] auto value_gradients(const P& points, const rounded_values& values,
                                   neighborhood_spec spec, const execution& how = {})
    -> point_matrix<scalar_of<P>, dimension_of<P>> {
  using S = scalar_of<P>;
  constexpr int C = closed_dimension<dimension_of<P>>;
  return closed_gradients<S, C>(
      {points_view<S, C>{points_in(points)}, points_view<S, C>{normals_in(points)}}, values.values,
      values.rounding, spec, how);
}
export template <OrientedPoints P, PointwiseNumbers V>
[[nodiscard]] auto value_gradients(const P& points, const V& values, neighborhood_spec spec,
                                   const execution& how = {})
    -> point_matrix<scalar_of<P>, dimension_of<P>> {
  return value_gradients(points, rounded_values::of(values), spec, how);
}

#define CILANTRO_COMPILED_ELSEWHERE(S, D)                                                \
  extern template point_matrix<S, D> closed_gradients(const oriented_points_view<S, D>&, \
                                                      std::span<const double>, double,   \
                                                      const neighborhood_spec&, const execution&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
