// SPDX-License-Identifier: MIT
export module cilantro.search:pair;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// Whether two points belong together: a function of their indices i and j and of the distance
/// between them, or of the distance alone, that returns bool. A lambda is a model. Pure, symmetric
/// if both indices are of one set, and called from several threads at once. Models: `close_points`,
/// `similar_normals`, `similar_colors`, `all_similar`.
export template <class F, class S>
concept SimilarityFunction = requires(const F& f, index_t i, S distance) {
  { f(i, i, distance) } -> std::same_as<bool>;
} || requires(const F& f, S distance) {
  { f(distance) } -> std::same_as<bool>;
};

/// How much a pair of points counts: a function of their indices i and j and of the distance
/// between them, or of the distance alone, that returns a number. Pure, and called from several
/// threads at once. Models: `unit_weight`, `distance_weight`, `gaussian`, and the robust weights
/// such as `huber`; any lambda. A `Kernel` is not one: it takes a number of bandwidths, not a
/// distance.
export template <class F, class S>
concept PairWeight = !requires(const F& f) { f.support; } &&
                        (requires(const F& f, index_t i, S distance) {
                          { f(i, i, distance) } -> std::convertible_to<S>;
                        } || requires(const F& f, S distance) {
                          { f(distance) } -> std::convertible_to<S>;
                        });

/// The value of `f` for the pair, whichever arguments it takes.
export template <Scalar S, class F>
  requires SimilarityFunction<F, S> || PairWeight<F, S>
[[nodiscard]] auto evaluate_pair(const F& f, index_t i, index_t j, S distance) {
  if constexpr (std::invocable<const F&, index_t, index_t, S>)
    return f(i, j, distance);
  else
    return f(distance);
}

/// Throws `invalid_input` if `f` was built for sets of other sizes than `first` and `second`, those
/// whose pairs it is about to evaluate. Does nothing unless `f` has a member of the same name.
export template <class F>
void expect_sizes(const F& f, index_t first, index_t second, const char* who) {
  if constexpr (requires { f.expect_sizes(first, second, who); })
    f.expect_sizes(first, second, who);
}

/// Two sets of columns to compare, which may be the same: i is an index into the first and j into
/// the second.
template <Scalar S, int D>
struct column_pair {
  points_view<S, D> first, second;

  column_pair(points_view<S, D> a, points_view<S, D> b) : first{a}, second{b} {
    expects(a.empty() || b.empty() || a.dimension() == b.dimension(),
            "the two sets must have the same dimension");
  }
  [[nodiscard]] S squared_distance(index_t i, index_t j) const {
    return (first[i] - second[j]).squaredNorm();
  }
  void expect_sizes(index_t a, index_t b, const char* who) const {
    if (first.size() == a && second.size() == b) return;
    const auto both = [](index_t m, index_t n) {
      return std::to_string(m) + (m == n ? "" : " and " + std::to_string(n));
    };
    throw invalid_input{std::string{who} + ": there are " + both(a, b) +
                        " points, but the similarity function views " +
                        both(first.size(), second.size())};
  }
};

/// Points are similar if at most `max_distance` apart, in the units of the coordinates. Views its
/// points, which must outlive it.
export template <Scalar S, int D>
class close_points {
 public:
  /// Compares points i and j of one set. Throws `invalid_input` for a negative distance or NaN.
  template <BorrowedPoints P>
  close_points(P&& points, double max_distance)
      : close_points{points, std::forward<P>(points), max_distance} {}
  /// Compares point i of the first set with point j of the second.
  template <BorrowedPoints P, BorrowedPoints Q>
  close_points(P&& first, Q&& second, double max_distance)
      : columns_{as_points(std::forward<P>(first)), as_points(std::forward<Q>(second))},
        limit_{static_cast<S>(max_distance * max_distance)} {
    expect_from(0, max_distance, "close_points: the distance");
  }

  /// Throws `invalid_input`, naming `who`, unless the two sets have these sizes.
  void expect_sizes(index_t first, index_t second, const char* who) const {
    columns_.expect_sizes(first, second, who);
  }
  [[nodiscard]] bool operator()(index_t i, index_t j, S) const {
    return columns_.squared_distance(i, j) <= limit_;
  }

 private:
  column_pair<S, D> columns_;
  S limit_;
};
export template <PointsSource P, class... Rest>
close_points(P&&, Rest&&...) -> close_points<scalar_of<P>, dimension_of<P>>;

/// Options of `similar_normals`.
export struct similar_normals_options {
  /// Whether n and −n count as the same, for normals that are not oriented.
  bool ignore_sign = false;
};

/// Unit normals are similar if at most `max_angle` apart, in radians. Identical normals always are;
/// zero normals, which stand for unknown ones, never are. Views its normals, which must outlive it.
export template <Scalar S, int D>
class similar_normals {
 public:
  /// Compares normals i and j of one set. Throws `invalid_input` unless the angle is from 0 to π.
  template <BorrowedPoints P>
    requires PointwiseVectors<P>
  similar_normals(P&& normals, double max_angle, similar_normals_options options = {})
      : similar_normals{normals, std::forward<P>(normals), max_angle, options} {}
  /// Compares normal i of the first set with normal j of the second.
  template <BorrowedPoints P, BorrowedPoints Q>
    requires PointwiseVectors<P> && PointwiseVectors<Q>
  similar_normals(P&& first, Q&& second, double max_angle, similar_normals_options options = {})
      : columns_{as_points(std::forward<P>(first)), as_points(std::forward<Q>(second))},
        options_{options} {
    expect_angle(max_angle, "similar_normals: the angle");
    // Angles are compared by their chords: an arc cosine would turn rounding into angles, or NaN.
    constexpr double pi = 3.14159265358979323846;
    const double chord = 2 * std::sin(std::min(max_angle, pi) / 2);
    limit_ = max_angle >= pi ? std::numeric_limits<S>::infinity() : static_cast<S>(chord * chord);
  }

  /// Throws `invalid_input`, naming `who`, unless the two sets have these sizes.
  void expect_sizes(index_t first, index_t second, const char* who) const {
    columns_.expect_sizes(first, second, who);
  }
  [[nodiscard]] bool operator()(index_t i, index_t j, S) const {
    const auto a = columns_.first[i];
    const auto b = columns_.second[j];
    const S same = (a - b).squaredNorm();
    const S chord = options_.ignore_sign ? std::min(same, (a + b).squaredNorm()) : same;
    // Most pairs fail the first test, so that the zero tests cost little.
    return chord <= limit_ && !a.isZero(0) && !b.isZero(0);
  }

 private:
  column_pair<S, D> columns_;
  similar_normals_options options_;
  S limit_;
};
export template <PointsSource P>
similar_normals(P&&, double, similar_normals_options = {})
    -> similar_normals<scalar_of<P>, dimension_of<P>>;
export template <PointsSource P, PointsSource Q>
similar_normals(P&&, Q&&, double, similar_normals_options = {})
    -> similar_normals<scalar_of<P>, dimension_of<P>>;

/// Colours are similar if at most `max_distance` apart in the cube of red, green and blue in [0,
/// 1], where black and white are √3 apart. Views its colours, which must outlive it.
export class similar_colors {
 public:
  /// Compares colours i and j of one set. Throws `invalid_input` for a negative distance or NaN.
  template <BorrowedPoints P>
    requires PointwiseVectors<P>
  similar_colors(P&& colors, double max_distance) : compare_{colors, max_distance} {}
  /// Compares colour i of the first set with colour j of the second.
  template <BorrowedPoints P, BorrowedPoints Q>
    requires PointwiseVectors<P> && PointwiseVectors<Q>
  similar_colors(P&& first, Q&& second, double max_distance)
      : compare_{first, second, max_distance} {}

  /// Throws `invalid_input`, naming `who`, unless the two sets have these sizes.
  void expect_sizes(index_t first, index_t second, const char* who) const {
    compare_.expect_sizes(first, second, who);
  }
  template <Scalar S>
  [[nodiscard]] bool operator()(index_t i, index_t j, S) const {
    return compare_(i, j, 0);
  }

 private:
  close_points<float, 3> compare_;
};

/// Points are similar if all of several functions say so; they are asked in order until one says
/// no.
export template <class... F>
class all_similar {
 public:
  explicit all_similar(F... functions) : functions_{std::move(functions)...} {}

  /// Throws `invalid_input`, naming `who`, unless the two sets have these sizes.
  void expect_sizes(index_t first, index_t second, const char* who) const {
    std::apply([&](const auto&... f) { (cilantro::expect_sizes(f, first, second, who), ...); },
               functions_);
  }
  template <Scalar S>
    requires(SimilarityFunction<F, S> && ...)
  [[nodiscard]] bool operator()(index_t i, index_t j, S distance) const {
    return std::apply([&](const auto&... f) { return (evaluate_pair(f, i, j, distance) && ...); },
                      functions_);
  }

 private:
  std::tuple<F...> functions_;
};

static_assert(SimilarityFunction<similar_normals<float, 3>, float>);
static_assert(SimilarityFunction<all_similar<close_points<double, 2>, similar_colors>, double>);

}  // namespace cilantro
