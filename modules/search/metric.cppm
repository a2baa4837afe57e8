// SPDX-License-Identifier: MIT
export module cilantro.search:metric;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// A distance that is a monotone function of a sum over coordinates.
///
/// `term(a - b)` is what one coordinate adds, not negative; `distance(sum)` turns the sum into the
/// distance that users see, `sum(distance)` is its inverse. All are static, pure and monotone.
/// Models: `euclidean`.
export template <class M>
concept Metric = requires(float f, double d) {
  { M::term(f) } -> std::same_as<float>;
  { M::term(d) } -> std::same_as<double>;
  { M::distance(f) } -> std::same_as<float>;
  { M::sum(f) } -> std::same_as<float>;
};

/// The straight-line distance √Σ(aᵢ − bᵢ)², in the units of the coordinates.
export struct euclidean {
  template <Scalar S>
  static S term(S difference) {
    return difference * difference;
  }
  template <Scalar S>
  static S distance(S sum) {
    return std::sqrt(sum);
  }
  template <Scalar S>
  static S sum(S distance) {
    return distance * distance;
  }
};
static_assert(Metric<euclidean>);

/// Points and queries with a coordinate beyond this are treated like non-finite ones: no sum of
/// squared differences of the others can overflow. About 5e18 for float and 4e153 for double.
export template <Scalar S>
[[nodiscard]] S largest_searchable_coordinate(index_t dimension) {
  return std::sqrt(std::numeric_limits<S>::max() / S(dimension > 0 ? dimension : 1)) / 2;
}

/// Whether a point of `dimension` coordinates takes part in a search. False for NaN.
export template <Scalar S>
[[nodiscard]] bool is_searchable(const S* point, index_t dimension, S largest_coordinate) {
  for (index_t d = 0; d < dimension; ++d)
    if (!(std::abs(point[d]) <= largest_coordinate)) return false;
  return true;
}

/// Σ `M::term` over the coordinates of `a` and `b`, in the order of the coordinates. Every searcher
/// sums like this, so that they agree to the bit.
export template <Metric M, Scalar S>
[[nodiscard]] S metric_sum(const S* a, const S* b, index_t dimension) {
  S sum = 0;
  for (index_t d = 0; d < dimension; ++d) sum += M::term(a[d] - b[d]);
  return sum;
}

}  // namespace cilantro
