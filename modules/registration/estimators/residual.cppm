// SPDX-License-Identifier: MIT
export module cilantro.registration:residual;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :correspondence;

namespace cilantro {

/// A pair as it is passed to a residual term: in double, in the coordinates of the target.
export template <int D>
struct matched_pair {
  using vector = point_vector<double, D>;

  vector point;                        ///< The source point, moved by the current transform.
  vector target;                       ///< The target point.
  vector normal;                       ///< The source normal, moved; zero if unknown or not needed.
  vector target_normal;                ///< Zero if unknown or not needed.
  index_t source_index, target_index;  ///< Indices of the two points.
};

/// Receives the rows of a residual: `emit(value, gradient)`, where the gradient is the derivative
/// of the value by the moved source point; and `emit(value, gradient, at)` for a row whose gradient
/// acts at another place than that point.
template <int D>
struct residual_sink {
  void operator()(double value, const point_vector<double, D>& gradient) const;
  void operator()(double value, const point_vector<double, D>& gradient,
                  const point_vector<double, D>& at) const;
};

/// What a registration makes small: the distance of a pair in some sense.
///
/// Semantics: `term(pair, emit)` calls `emit(value, gradient)` once for each row of the residual,
/// in the units of the points, or not at all for a pair that does not count. Static constants
/// `needs_source_normals` and `needs_target_normals` say whether it uses these normals; without the
/// constants, the normals of pairs are zero. Pure, and called from several threads at once. A term
/// that holds something per point may have a member `expect_sizes(sources, targets, who)`, which
/// throws if it is of other points; estimators call it. A metric of yours is a struct or a generic
/// lambda of a few lines.
/// Models: `point_to_point`, `point_to_plane`, `colored_point_to_plane`, `symmetric`,
/// `generalized_icp`, `weighted_term`, `combined_metric`; `check_residual_term` tests yours.
export template <class T, int D>
concept ResidualTerm =
    requires(const T& term, const matched_pair<D>& pair, const residual_sink<D>& emit) {
      { term(pair, emit) } -> std::same_as<void>;
    };

namespace detail {
/// Whether a metric uses the normals of the source.
export template <class T>
inline constexpr bool needs_source_normals = false;
template <class T>
  requires requires { T::needs_source_normals; }
inline constexpr bool needs_source_normals<T> = T::needs_source_normals;
/// Whether a metric uses the normals of the target.
export template <class T>
inline constexpr bool needs_target_normals = false;
template <class T>
  requires requires { T::needs_target_normals; }
inline constexpr bool needs_target_normals<T> = T::needs_target_normals;
}  // namespace detail
using detail::needs_source_normals;
using detail::needs_target_normals;

/// The vector from the target point to the moved source point: one row per coordinate.
/// Source: Besl & McKay 1992, "A method for registration of 3-D shapes".
export struct point_to_point {
  template <int D, class Emit>
  void operator()(const matched_pair<D>& pair, const Emit& emit) const {
    using vector = typename matched_pair<D>::vector;
    const vector difference = pair.point - pair.target;
    for (index_t d = 0; d < difference.size(); ++d)
      emit(difference[d], vector{vector::Unit(difference.size(), d)});
  }
};

/// The signed distance to the plane through the target point across its normal. Pairs whose target
/// normal is unknown are skipped.
/// Source: Chen & Medioni 1992, "Object modelling by registration of multiple range images".
export struct point_to_plane {
  static constexpr bool needs_target_normals = true;

  template <int D, class Emit>
  void operator()(const matched_pair<D>& pair, const Emit& emit) const {
    if (pair.target_normal.isZero(0)) return;
    emit((pair.point - pair.target).dot(pair.target_normal), pair.target_normal);
  }
};

/// The signed distance along the mean of both normals, which is zero wherever the two points lie on
/// one circular arc: it converges from farther away than `point_to_plane`. The signs of normals do
/// not matter.
/// Source: Rusinkiewicz 2019, "A symmetric objective function for ICP", equation 9.
export struct symmetric {
  static constexpr bool needs_source_normals = true, needs_target_normals = true;

  template <int D, class Emit>
  void operator()(const matched_pair<D>& pair, const Emit& emit) const {
    using vector = typename matched_pair<D>::vector;
    const double side = pair.normal.dot(pair.target_normal) < 0 ? -0.5 : 0.5;
    const vector normal = side * pair.normal + 0.5 * pair.target_normal;
    if (normal.isZero(0)) return;
    // Both sides turn by half of the rotation, so that it acts midway.
    emit((pair.point - pair.target).dot(normal), normal, vector{0.5 * (pair.point + pair.target)});
  }
};

/// Plane to plane: the Mahalanobis distance under the covariances of both points, each flat along
/// its normal. Between two planes it acts as `point_to_plane`; a point whose normal is unknown has
/// the same variance in all directions. Scaled so that a distance along a common normal has weight
/// 1.
/// Source: Segal, Haehnel & Thrun 2009, "Generalized-ICP", section III, plane-to-plane.
export struct generalized_icp {
  static constexpr bool needs_source_normals = true, needs_target_normals = true;

  positive flatness = 1e-3;  ///< Variance along the normal, relative to that along the surface.

  template <int D, class Emit>
  void operator()(const matched_pair<D>& pair, const Emit& emit) const {
    using vector = typename matched_pair<D>::vector;
    using matrix = Eigen::Matrix<double, D, D>;
    const index_t d = pair.point.size();
    const double thin = 1 - double(flatness);
    const matrix sum =
        2 * matrix::Identity(d, d) - thin * (pair.normal * pair.normal.transpose() +
                                             pair.target_normal * pair.target_normal.transpose());
    // sum = L Lᵀ, so that eᵀ sum⁻¹ e = ‖L⁻¹ e‖².
    const Eigen::LLT<matrix> factor{sum};
    matrix rows = std::sqrt(2 * double(flatness)) * matrix::Identity(d, d);
    factor.matrixL().solveInPlace(rows);
    const vector values = rows * (pair.point - pair.target);
    for (index_t i = 0; i < d; ++i) emit(values[i], vector{rows.row(i).transpose()});
  }
};

/// A `term` with weights: a factor, `weight`; a `PairWeight` of source index, target index and the
/// distance that the search has found, `pairs`; and a `robust` kernel of the residual's length,
/// which leads to iteratively reweighted least squares: `weighted_term{point_to_plane{}, 1, {},
/// huber{0.01}}`.
export template <class Term, class Pairs = unit_weight, class Kernel = unit_weight>
struct weighted_term {
  static constexpr bool needs_source_normals = cilantro::needs_source_normals<Term>;
  static constexpr bool needs_target_normals = cilantro::needs_target_normals<Term>;

  Term term;
  double weight;
  Pairs pairs;
  Kernel robust;

  explicit weighted_term(Term what, double factor = 1)
    requires requires { Pairs{}; } && requires { Kernel{}; }
      : weighted_term{std::move(what), factor, Pairs{}} {}
  weighted_term(Term what, double factor, Pairs by)
    requires requires { Kernel{}; }
      : weighted_term{std::move(what), factor, std::move(by), Kernel{}} {}
  weighted_term(Term what, double factor, Pairs by, Kernel of_residual)
      : term{std::move(what)},
        weight{factor},
        pairs{std::move(by)},
        robust{std::move(of_residual)} {}
};
export template <class Term>
weighted_term(Term, double = 1) -> weighted_term<Term>;
export template <class Term, class Pairs>
weighted_term(Term, double, Pairs) -> weighted_term<Term, Pairs>;
export template <class Term, class Pairs, class Kernel>
weighted_term(Term, double, Pairs, Kernel) -> weighted_term<Term, Pairs, Kernel>;

/// The sum of several terms, each a residual term or a `weighted_term`. With a `combined_searcher`,
/// each has pairs of its own.
export template <class... Terms>
class combined_metric {
 public:
  static constexpr bool needs_source_normals = (cilantro::needs_source_normals<Terms> || ...);
  static constexpr bool needs_target_normals = (cilantro::needs_target_normals<Terms> || ...);
  static constexpr std::size_t size = sizeof...(Terms);

  explicit combined_metric(Terms... terms) : terms_{std::move(terms)...} {}

  template <std::size_t I>
  [[nodiscard]] const auto& term() const {
    return std::get<I>(terms_);
  }

 private:
  std::tuple<Terms...> terms_;
};

template <class T>
inline constexpr bool is_weighted = false;
template <class T, class P, class K>
inline constexpr bool is_weighted<weighted_term<T, P, K>> = true;
namespace detail {
/// Whether a metric is a `combined_metric`.
export template <class T>
inline constexpr bool is_combined = false;
template <class... T>
inline constexpr bool is_combined<combined_metric<T...>> = true;
}  // namespace detail
using detail::is_combined;

template <class T, int D>
inline constexpr bool is_metric = ResidualTerm<T, D>;
template <class T, class P, class K, int D>
inline constexpr bool is_metric<weighted_term<T, P, K>, D> =
    ResidualTerm<T, D> && PairWeight<P, double> && PairWeight<K, double>;
template <class... T, int D>
inline constexpr bool is_metric<combined_metric<T...>, D> =
    ((!is_combined<T> && is_metric<T, D>) && ...);

/// What a registration minimises: a `ResidualTerm`, a `weighted_term` of one, or a
/// `combined_metric` of several.
export template <class T, int D>
concept RegistrationMetric = ResidualTerm<T, D> || is_metric<T, D>;

namespace detail {
/// Calls `f(term, weight, pair weight, kernel)` for a term.
template <class Metric, class F>
void with_weights(const Metric& metric, F&& f) {
  if constexpr (is_weighted<Metric>)
    f(metric.term, metric.weight, metric.pairs, metric.robust);
  else
    f(metric, 1.0, unit_weight{}, unit_weight{});
}

/// The same for each term of a metric.
export template <class Metric, class F>
void with_terms(const Metric& metric, F&& f) {
  if constexpr (is_combined<Metric>)
    [&]<std::size_t... I>(std::index_sequence<I...>) {
      (with_weights(metric.template term<I>(), f), ...);
    }(std::make_index_sequence<Metric::size>{});
  else
    with_weights(metric, f);
}

/// The pair of a moved point and its partner. `moved_normal()` is called if it is needed.
export template <bool SourceNormals, bool TargetNormals, Scalar S, int D, class F>
[[nodiscard]] matched_pair<D> pair_at(const point_vector<double, D>& moved,
                                      const oriented_points_view<S, D>& target, index_t s,
                                      index_t t, F&& moved_normal) {
  using vector = point_vector<double, D>;
  matched_pair<D> pair{moved,
                       target.points[t].template cast<double>(),
                       vector::Zero(moved.size()),
                       vector::Zero(moved.size()),
                       s,
                       t};
  if constexpr (TargetNormals) pair.target_normal = target.normals[t].template cast<double>();
  if constexpr (SourceNormals) {
    pair.normal = moved_normal();
    if (const double length = pair.normal.norm(); length > 0) pair.normal /= length;
  }
  return pair;
}
}  // namespace detail
using detail::pair_at;
using detail::with_terms;

/// For estimators of yours: `matcher(pair)` is the pair that is passed to a metric, after a
/// `PointMap` has moved the source. An affine map moves points in double, a field in its own
/// scalar. Keeps a field by reference, and views the points.
export template <class Metric, class M, Scalar S, int D>
class pair_matcher {
 public:
  /// Throws `invalid_input` for a map for another dimension or number of points, and if the metric
  /// needs normals that the points do not have.
  pair_matcher(const Metric& metric, const M& map [[clang::lifetimebound]],
               const oriented_points_view<S, D>& source, const oriented_points_view<S, D>& target)
      : source_{moved_by(map, source)}, target_{target}, move_{mover(map)}, turn_{turner(map)} {
    with_terms(metric, [&](const auto& term, const auto&...) {
      expect_sizes(term, source.points.size(), target.points.size(), "pair_matcher");
    });
    expects(!needs_source_normals<Metric> || source.has_normals() || source.points.empty(),
            "pair_matcher: the metric needs normals of the source; estimate them first");
    expects(!needs_target_normals<Metric> || target.has_normals() || target.points.empty(),
            "pair_matcher: the metric needs normals of the target; estimate them first");
  }
  /// As above, for clouds and any other points with normals.
  template <BorrowedPoints P, BorrowedPoints T>
    requires(!std::same_as<std::remove_cvref_t<P>, oriented_points_view<S, D>>)
  pair_matcher(const Metric& metric, const M& map [[clang::lifetimebound]], P&& source, T&& target)
      : pair_matcher{metric, map, oriented_points_view<S, D>{as_points(source), normals_in(source)},
                     oriented_points_view<S, D>{as_points(target), normals_in(target)}} {
    expect_same_origin(source, target, "pair_matcher");
  }

  /// The pair, moved. Throws `invalid_input` if one of its indices is out of range.
  [[nodiscard]] matched_pair<D> operator()(const correspondence<S>& pair) const {
    const index_t s = pair.source;
    expects(0 <= s && s < source_.points.size() && 0 <= pair.target &&
                pair.target < target_.points.size(),
            "pair_matcher: the pair is not of these points");
    return pair_at<needs_source_normals<Metric>, needs_target_normals<Metric>>(
        move_(s, source_.points[s]), target_, s, pair.target,
        [&] { return turn_(s, source_.normals[s]); });
  }

 private:
  static_assert(RegistrationMetric<Metric, D> && PointMap<M, D> &&
                std::same_as<typename M::Scalar, S>);
  static_assert(!needs_source_normals<Metric> || NormalMap<M, D>,
                "the metric needs normals of the source, and the map has no member normal(i, n)");
  using vector = point_vector<double, D>;

  /// Checks the map before it is used.
  static const oriented_points_view<S, D>& moved_by(const M& map,
                                                    const oriented_points_view<S, D>& source) {
    expect_moves(map, source.points, "pair_matcher");
    return source;
  }
  static auto mover(const M& map) {
    if constexpr (AffineMap<M>)
      return [move = affine_parts<double, D>{map}](index_t, const auto& p) { return move(p); };
    else
      return [&map](index_t s, const auto& p) {
        return vector{moved_point(map, s, p).template cast<double>()};
      };
  }
  static auto turner(const M& map) {
    if constexpr (needs_source_normals<Metric>)
      return [turn = normals_moved_by<D>(map)](index_t s, const auto& n) {
        return vector{turn(s, n).template cast<double>()};
      };
    else
      return [](index_t, const auto&) { return vector{}; };
  }

  oriented_points_view<S, D> source_, target_;
  decltype(mover(std::declval<const M&>())) move_;
  decltype(turner(std::declval<const M&>())) turn_;
};

export template <class Metric, class M, PointsSource P, PointsSource T>
pair_matcher(const Metric&, const M&, P&&, T&&)
    -> pair_matcher<Metric, M, scalar_of<P>, dimension_of<P>>;

namespace detail {
/// Throws `invalid_input` for a weight that is negative or NaN.
export inline void expect_weight(double weight) {
  if (!(weight >= 0))
    throw invalid_input{"registration: a pair has the weight " + in_digits(weight) +
                        ", from its term, its pair weight or its robust kernel"};
}

/// The length of a term's residual for a pair, by which its kernel weights it.
export template <int D, class Term>
[[nodiscard]] double residual_length(const Term& term, const matched_pair<D>& pair) {
  double square = 0;
  term(pair, [&](double value, const auto&...) { square += value * value; });
  return std::sqrt(square);
}
}  // namespace detail
using detail::expect_weight;
using detail::residual_length;

/// The rows of one term for one pair, as `weighted_rows` says.
template <int D, class Term, class Pairs, class Kernel, class Emit>
void rows_of_term(const Term& term, double weight, const Pairs& by, const Kernel& robust,
                  const matched_pair<D>& pair, double distance, Emit&& emit) {
  using vector = point_vector<double, D>;
  weight *= double(evaluate_pair<double>(by, pair.source_index, pair.target_index, distance));
  if constexpr (!std::same_as<Kernel, unit_weight>) {
    bool is_robust = true;
    if constexpr (std::same_as<Kernel, robust_kernel>) is_robust = static_cast<bool>(robust);
    if (is_robust) {
      const double length = residual_length(term, pair);
      if (!std::isfinite(length)) return;
      weight *= double(evaluate_pair<double>(robust, pair.source_index, pair.target_index, length));
    }
  }
  expect_weight(weight);
  if (weight == 0) return;
  const auto add = [&](double value, const vector& gradient, const vector& at) {
    if (std::isfinite(value)) emit(weight, value, gradient, at);
  };
  term(pair, [&](double value, const vector& gradient, const auto&... at) {
    if constexpr (sizeof...(at) == 0)
      add(value, gradient, pair.point);
    else
      add(value, gradient, at...);
  });
}

/// For estimators of yours: calls `emit(weight, value, gradient, at)` for each row of a metric for
/// one pair, in the order of its terms. `value` is the residual, `gradient` its derivative by the
/// moved point, and `at` the place where the gradient acts: the moved point, except for
/// `symmetric`. Each row adds weight · value² to what is minimised, with the weights of iteratively
/// reweighted least squares. `distance` is that of the correspondence. Rows with weight 0, or whose
/// value is not finite, are left out. Throws `invalid_input` for a weight that is negative or NaN.
export template <int D, class Metric, class Emit>
  requires RegistrationMetric<Metric, D>
void weighted_rows(const Metric& metric, const matched_pair<D>& pair, double distance,
                   Emit&& emit) {
  with_terms(metric, [&](const auto& term, double weight, const auto& by, const auto& robust) {
    rows_of_term(term, weight, by, robust, pair, distance, emit);
  });
}

static_assert(ResidualTerm<point_to_point, 5> && ResidualTerm<point_to_plane, 3>);
static_assert(ResidualTerm<symmetric, 2> && ResidualTerm<generalized_icp, dynamic>);

}  // namespace cilantro
