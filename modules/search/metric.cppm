// SPDX-License-Identifier: MIT
export module cilantro.search:metric;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// A distance that is a monotone function of a sum over coordinates, so that trees can search by
/// it.
///
/// `term(a − b, axis)` is what one coordinate adds: not negative, and not smaller for a larger
/// |a − b| (unless `term_to` says otherwise). `distance(sum)` turns the sum into the distance that
/// users see, and `sum(distance)` is its inverse; both are monotone. All are const or static, and
/// pure. A model may also have
///
/// - `combine(a, b)` in place of a + b; it must be idempotent, as the larger of the two is;
/// - `term_to(value, low, high, axis)`, the smallest term between `value` and anything in [low,
///   high]; needed if the terms do not grow with |a − b|, as for angles;
/// - `antipodal`, a static constant: true if p and −p stand for the same point;
/// - `dimension`, a static constant: the only dimension that the metric is for.
///
/// Models: `euclidean`, `manhattan`, `chebyshev`, `so2`, `so3`, and any struct like them.
export template <class M, class S = float>
concept CoordinateMetric = requires(const M& metric, S value, index_t axis) {
  { metric.term(value, axis) } -> std::same_as<S>;
  { metric.distance(value) } -> std::same_as<S>;
  { metric.sum(value) } -> std::same_as<S>;
};

/// How far apart two points are: a `CoordinateMetric`, or any function of two points that returns
/// their distance, not negative. Trees need a `CoordinateMetric`; `brute_force_searcher` accepts
/// any.
export template <class M, class S, int D>
concept Metric = CoordinateMetric<M, S> ||
                 requires(const M& metric, typename points_view<S, D>::point_type point) {
                   { metric(point, point) } -> std::convertible_to<S>;
                 };

/// The straight-line distance √Σ(aᵢ − bᵢ)² (L2), in the units of the coordinates.
export struct euclidean {
  template <Scalar S>
  static S term(S difference, index_t) {
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

/// The distance along the axes Σ|aᵢ − bᵢ| (L1), in the units of the coordinates.
export struct manhattan {
  template <Scalar S>
  static S term(S difference, index_t) {
    return std::abs(difference);
  }
  template <Scalar S>
  static S distance(S sum) {
    return sum;
  }
  template <Scalar S>
  static S sum(S distance) {
    return distance;
  }
};

/// The largest difference max|aᵢ − bᵢ| (L∞), in the units of the coordinates.
export struct chebyshev : manhattan {
  template <Scalar S>
  static S combine(S a, S b) {
    return std::max(a, b);
  }
};

/// Coordinates are angles in radians, of any size, that wrap around at 2π: √Σδᵢ², where δᵢ is the
/// shorter way around from one to the other. With one coordinate, this is the angle between two
/// planar rotations, in [0, π].
export struct so2 : euclidean {
  template <Scalar S>
  static constexpr S turn = S(6.283185307179586476925286766559);

  template <Scalar S>
  static S term(S difference, index_t) {
    const S wrapped = std::remainder(difference, turn<S>);
    return wrapped * wrapped;
  }
  template <Scalar S>
  static S term_to(S value, S low, S high, index_t) {
    const S width = high - low;
    const S ahead = value - low - turn<S> * std::floor((value - low) / turn<S>);
    const S outside = std::min(ahead - width, turn<S> - ahead);
    // The reductions round at the size of their arguments, however small the result.
    const S rounding = 16 * std::numeric_limits<S>::epsilon() *
                       (turn<S> + std::abs(value) + std::abs(low) + std::abs(high));
    const S safe = std::max(S(0), outside - rounding);
    return safe * safe;
  }
};

/// Points are unit quaternions, in any order of the components, q and −q being the same rotation:
/// the angle of the rotation between two of them, in radians, in [0, π].
///
/// Searches compare the chord c, the smaller of |a − b| and |a + b|; the angle is 4 asin(c / 2).
export struct so3 : euclidean {
  static constexpr bool antipodal = true;
  static constexpr int dimension = 4;

  template <Scalar S>
  static S distance(S sum) {
    return 4 * std::asin(std::min(std::sqrt(sum) / 2, S(1)));
  }
  template <Scalar S>
  static S sum(S distance) {
    // No two rotations are farther apart than half a turn, where the sum would round.
    if (distance >= S(3.14159265358979323846)) return std::numeric_limits<S>::infinity();
    const S chord = 2 * std::sin(distance / 4);
    return chord * chord;
  }
};

static_assert(CoordinateMetric<euclidean> && CoordinateMetric<euclidean, double>);
static_assert(CoordinateMetric<manhattan> && CoordinateMetric<chebyshev>);
static_assert(CoordinateMetric<so2> && CoordinateMetric<so3>);

template <class M>
inline constexpr bool is_antipodal = false;
template <class M>
  requires(bool(M::antipodal))
inline constexpr bool is_antipodal<M> = true;

/// Throws `invalid_input` if the metric is for another dimension.
template <class M>
void expect_dimension(index_t dimension) {
  if constexpr (requires { M::dimension; })
    expects(dimension == M::dimension, "the metric is for points of " +
                                           std::to_string(M::dimension) + " coordinates, not of " +
                                           std::to_string(dimension));
}

template <class M, Scalar S>
S combine_terms(const M& metric, S a, S b) {
  if constexpr (requires { metric.combine(a, b); })
    return metric.combine(a, b);
  else
    return a + b;
}

/// The largest sum whose distance is at most `distance`, so that a point at exactly the distance
/// that the library itself reported is found. (The square of a rounded root is often below the
/// sum.)
template <class M, Scalar S>
  requires CoordinateMetric<M, S>
[[nodiscard]] S largest_sum_within(const M& metric, S distance) {
  constexpr S infinity = std::numeric_limits<S>::infinity();
  S sum = metric.sum(distance);
  // A few roundings of both functions; where one is constant, the loop would not end.
  for (int step = 0; step < 16 && sum < infinity; ++step) {
    const S next = std::nextafter(sum, infinity);
    if (!(metric.distance(next) <= distance)) break;
    sum = next;
  }
  return sum;
}

/// Points and queries with a coordinate whose magnitude is beyond this are treated as non-finite,
/// so that no sum of squared differences can overflow. About 5e18 for float in 3D and 4e153 for
/// double. At the other end, distances below about 1e-19 for float and 1e-154 for double lose
/// digits or become 0, since their squares underflow: scale points in such small units.
export template <Scalar S>
[[nodiscard]] S largest_searchable_coordinate(index_t dimension) {
  return std::sqrt(std::numeric_limits<S>::max() / S(dimension > 0 ? dimension : 1)) / 2;
}

/// Whether a point of `dimension` coordinates takes part in searches: none beyond the limit, none
/// NaN.
export template <Scalar S>
[[nodiscard]] bool is_searchable(const S* point, index_t dimension, S largest_coordinate) {
  for (index_t d = 0; d < dimension; ++d)
    if (!(std::abs(point[d]) <= largest_coordinate)) return false;
  return true;
}

/// The terms between `a` and `b`, combined in the order of the coordinates; for an antipodal
/// metric, the smaller of this sum and the one between `a` and −b. All searchers of the library sum
/// like this, so that they agree to the bit.
export template <class M, Scalar S>
  requires CoordinateMetric<M, S>
[[nodiscard]] S metric_sum(const M& metric, const S* a, const S* b, index_t dimension) {
  S sum = 0;
  for (index_t d = 0; d < dimension; ++d)
    sum = combine_terms(metric, sum, metric.term(a[d] - b[d], d));
  if constexpr (is_antipodal<M>) {
    S other = 0;
    for (index_t d = 0; d < dimension; ++d)
      other = combine_terms(metric, other, metric.term(a[d] + b[d], d));
    sum = std::min(sum, other);
  }
  return sum;
}

/// A metric by which neighbours are ordered: its sum if it has one, otherwise its distance.
template <Scalar S, int D, Metric<S, D> M>
struct ordering {
  const M& metric;

  [[nodiscard]] S between(const S* a, const S* b, index_t dimension) const {
    if constexpr (CoordinateMetric<M, S>) {
      return metric_sum(metric, a, b, dimension);
    } else {
      using point = typename points_view<S, D>::point_type;
      return static_cast<S>(metric(point{a, dimension}, point{b, dimension}));
    }
  }
  [[nodiscard]] S distance(S order) const {
    if constexpr (CoordinateMetric<M, S>)
      return metric.distance(order);
    else
      return order;
  }
  [[nodiscard]] S limit(double distance) const {
    const S nearest = static_cast<S>(distance);
    if constexpr (CoordinateMetric<M, S>)
      return largest_sum_within(metric, nearest);
    else
      return nearest;
  }
};

}  // namespace cilantro
