// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
export module cilantro.registration:least_squares;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :concepts;
import :correspondence;
import :estimation;
import :motion;
import :normal_equations;
import :residual;
import :unit_normals;

namespace cilantro {

/// The normal equations of some pairs, as sums.
template <int D, int U>
struct equation_sums : place_sums<D> {
  Eigen::Matrix<double, U, U> information;  ///< The lower triangle.
  Eigen::Matrix<double, U, 1> gradient, row;

  equation_sums(index_t dimension, index_t unknowns)
      : place_sums<D>{dimension},
        information{Eigen::Matrix<double, U, U>::Zero(unknowns, unknowns)},
        gradient{Eigen::Matrix<double, U, 1>::Zero(unknowns)},
        row{gradient} {}
  equation_sums& operator+=(const equation_sums& other) {
    place_sums<D>::operator+=(other);
    information += other.information;
    gradient += other.gradient;
    return *this;
  }
  /// Adds a residual whose derivatives are in `row`.
  void add_row(double w, double value) {
    const index_t u = U == dynamic ? gradient.size() : U;
    for (index_t a = 0; a < u; ++a) {
      const double factor = w * row[a];
      gradient[a] += factor * value;
      for (index_t b = a; b < u; ++b) information(b, a) += factor * row[b];
    }
    this->squared_residual += w * value * value;
  }
};

template <MotionModel Model, int D>
inline constexpr int unknowns_of = D == dynamic ? dynamic : int(Model::unknowns(D));

/// Adds all terms of a metric for one pair.
template <int D, MotionModel Model, class Metric>
void add_pair(equation_sums<D, unknowns_of<Model, D>>& sums, const Model& model,
              const Metric& metric, const matched_pair<D>& pair, double distance,
              const point_vector<double, D>& center) {
  with_terms(metric, [&](const auto& term, double factor, const auto& by, const auto& robust) {
    double seen_weight = 0, largest_gradient = -1;
    rows_of_term(term, factor, by, robust, pair, distance,
                 [&](double weight, double value, const point_vector<double, D>& gradient,
                     const point_vector<double, D>& at) {
                   model.pull_back(point_vector<double, D>{at - center}, gradient, sums.row.data());
                   sums.add_row(weight, value);
                   seen_weight = weight;
                   largest_gradient = std::max(largest_gradient, gradient.squaredNorm());
                 });
    if (largest_gradient >= 0) sums.add_place(seen_weight, largest_gradient, pair.point - center);
  });
}

/// The pair as it is passed to the terms of a metric, under an affine map in double. `turn` is what
/// the map does to normals.
template <class Metric, Scalar S, int D>
[[nodiscard]] matched_pair<D> pair_in(const registered_surfaces<S, D>& surfaces,
                                      const affine_parts<double, D>& current,
                                      const Eigen::Matrix<double, D, D>& turn, index_t s,
                                      index_t t) {
  return pair_at<needs_source_normals<Metric>, needs_target_normals<Metric>>(
      current(surfaces.source.points[s]), surfaces.target, s, t,
      [&] { return turn * surfaces.source.normals[s].template cast<double>(); });
}

/// What a transform does to normals, if the metric needs those of the source.
template <class Metric, MotionModel Model, int D>
[[nodiscard]] Eigen::Matrix<double, D, D> turn_of(const affine_parts<double, D>& current) {
  if constexpr (!needs_source_normals<Metric> || RigidMap<transform_of<Model, double, D>>)
    return current.linear;
  else
    return checked_inverse(current.linear,
                           "least_squares_estimator: the transform cannot be inverted")
        .transpose();
}

/// Which of the two terms with a vector kernel a metric contains, and whether it has other terms.
struct kernel_terms {
  bool plane = false, point = false, others = false;
};
template <class Metric>
inline constexpr kernel_terms kernel_terms_of{.others = true};
template <>
inline constexpr kernel_terms kernel_terms_of<point_to_plane>{.plane = true};
template <>
inline constexpr kernel_terms kernel_terms_of<point_to_point>{.point = true};
template <class Term, class Pairs, class Kernel>
inline constexpr kernel_terms kernel_terms_of<weighted_term<Term, Pairs, Kernel>> =
    kernel_terms_of<Term>;
template <class A, class B>
inline constexpr kernel_terms kernel_terms_of<combined_metric<A, B>>{
    kernel_terms_of<A>.plane || kernel_terms_of<B>.plane,
    kernel_terms_of<A>.point || kernel_terms_of<B>.point,
    kernel_terms_of<A>.others || kernel_terms_of<B>.others ||
        kernel_terms_of<A>.plane == kernel_terms_of<B>.plane};

/// Writes the weights of pairs from `first` on in both terms, from their residuals along the
/// normals and their squared distances. Called from several threads at once.
using pair_weigher = std::function<void(index_t first, std::span<const double> along_normals,
                                        std::span<const double> squared_distances,
                                        double* plane_weights, double* point_weights)>;

template <Scalar S, class Metric>
[[nodiscard]] pair_weigher weigher_of(const Metric& metric,
                                      std::span<const correspondence<S>> pairs) {
  if constexpr (std::same_as<Metric, point_to_plane>) return {};  // All count alike.
  return [&metric, pairs](index_t first, std::span<const double> along_normals,
                          std::span<const double> squared_distances, double* plane_weights,
                          double* point_weights) {
    with_terms(metric,
               [&]<class Term>(const Term&, double weight, const auto& by, const auto& robust) {
                 constexpr bool is_plane = std::same_as<Term, point_to_plane>;
                 static_assert(is_plane || std::same_as<Term, point_to_point>);
                 double* const out = is_plane ? plane_weights : point_weights;
                 for (std::size_t k = 0; k < along_normals.size(); ++k) {
                   const auto& [s, t, distance] = pairs[static_cast<std::size_t>(first) + k];
                   const double residual =
                       is_plane ? std::abs(along_normals[k]) : std::sqrt(squared_distances[k]);
                   out[k] = 0;
                   if (!std::isfinite(residual)) continue;
                   out[k] = weight * double(evaluate_pair<double>(by, s, t, double(distance))) *
                            double(evaluate_pair<double>(robust, s, t, residual));
                   expect_weight(out[k]);
                 }
               });
  };
}

/// The sums of these terms under `rigid_motion` in three dimensions, which most registrations are,
/// by a vector kernel. Compiled in the library.
template <Scalar S>
[[nodiscard]] equation_sums<3, 6> sum_by_kernel(const registered_surfaces<S, 3>& surfaces,
                                                const affine_parts<double, 3>& current,
                                                std::span<const correspondence<S>> pairs,
                                                kernel_terms terms, const pair_weigher& weigh,
                                                const execution& how);

/// Of any metric and model.
template <Scalar S, int D, class Metric, MotionModel Model>
[[nodiscard]] auto sum_any_equations(const registered_surfaces<S, D>& surfaces,
                                     const affine_parts<double, D>& current,
                                     std::span<const correspondence<S>> pairs, const Metric& metric,
                                     const Model& model, const execution& how)
    -> equation_sums<D, unknowns_of<Model, D>> {
  const auto& [target, source, dimension, finite_sources, non_finite, center] = surfaces;
  const equation_sums<D, unknowns_of<Model, D>> zero{dimension, Model::unknowns(dimension)};
  const auto turn = turn_of<Metric, Model>(current);
  return ordered_sum(std::ssize(pairs), how, zero, [&](auto& sums, index_t i) {
    const auto& [s, t, distance] = pairs[i];
    const auto pair = pair_in<Metric>(surfaces, current, turn, s, t);
    const double square = (pair.point - pair.target).squaredNorm();
    if (!std::isfinite(square)) return;
    ++sums.pairs;
    sums.squared_distance += square;
    add_pair(sums, model, metric, pair, double(distance), center);
  });
}

/// The sums over pairs, in parallel and with the same bits for any number of threads.
template <Scalar S, int D, class Metric, MotionModel Model>
[[nodiscard]] auto sum_equations(const registered_surfaces<S, D>& surfaces,
                                 const affine_parts<double, D>& current,
                                 std::span<const correspondence<S>> pairs, const Metric& metric,
                                 const Model& model, const execution& how)
    -> equation_sums<D, unknowns_of<Model, D>> {
  constexpr kernel_terms terms = kernel_terms_of<Metric>;
  if constexpr (D == 3 && !terms.others && std::same_as<Model, rigid_motion>)
    return sum_by_kernel<S>(surfaces, current, pairs, terms, weigher_of<S>(metric, pairs), how);
  else
    return sum_any_equations<S, D>(surfaces, current, pairs, metric, model, how);
}

/// Improves a transform by one Gauss–Newton step, for any metric of residual terms, any motion
/// model and any solver. Normal equations are summed in double.
///
/// The transform does not change along directions that the residuals do not determine. Source
/// normals are constant within a step; between steps, they are turned by the inverse transpose of
/// the linear part. Views target and source, which must outlive it.
export template <Scalar S, int D, class Metric = point_to_plane, MotionModel Model = rigid_motion,
                 NormalEquationSolver Solver = truncated_solver>
  requires RegistrationMetric<Metric, closed_dimension<D>>
class least_squares_estimator {
 public:
  using transform_type = transform_of<Model, S, D>;

  /// Throws `invalid_input` if the metric needs normals that a surface does not have, or that are
  /// not of unit length, and for surfaces of different dimension or origin.
  template <BorrowedPoints T, BorrowedPoints P>
  least_squares_estimator(P&& source, T&& target, Metric metric = {}, Model model = {},
                          Solver solver = {}, execution how = {})
      : surfaces_{oriented<S, C>(target), oriented<S, C>(source)},
        metric_{std::move(metric)},
        model_{std::move(model)},
        solver_{std::move(solver)},
        how_{std::move(how)} {
    const auto& [t, s, dimension, finite_sources, non_finite, center] = surfaces_;
    expect_same_origin(source, target, "least_squares_estimator");
    expects(!needs_target_normals<Metric> || t.has_normals() || t.points.empty(),
            "least_squares_estimator: the metric needs normals of the target; estimate them first");
    expects(!needs_source_normals<Metric> || s.has_normals() || s.points.empty(),
            "least_squares_estimator: the metric needs normals of the source; estimate them first");
    if constexpr (needs_target_normals<Metric>) expect_unit_normals(t.normals, "target");
    if constexpr (needs_source_normals<Metric>) expect_unit_normals(s.normals, "source");
    with_terms(metric_, [&](const auto& term, double weight, const auto& by, const auto&) {
      expect_between(0, weight, std::numeric_limits<double>::max(),
                     "least_squares_estimator: the weight of a term");
      expect_sizes(term, s.points.size(), t.points.size(), "least_squares_estimator");
      expect_sizes(by, s.points.size(), t.points.size(), "least_squares_estimator");
    });
  }

  /// The identity, in the dimension of the surfaces.
  [[nodiscard]] transform_type identity() const {
    return identity_transform<transform_type>(surfaces_.dimension);
  }

  /// As `TransformEstimator` says. Throws `invalid_input` for a transform of another dimension.
  /// O(pairs · unknowns²).
  [[nodiscard]] registration_step<transform_type> estimate(
      const transform_type& current, std::span<const correspondence<S>> pairs) const {
    return solve(current, sum(current, pairs, metric_), count_sources<S>(pairs));
  }
  /// As above, with separate pairs for each term of a combined metric.
  template <std::size_t N>
    requires(is_combined<Metric>)
  [[nodiscard]] registration_step<transform_type> estimate(
      const transform_type& current, const std::array<correspondences<S>, N>& pairs) const {
    static_assert(N == Metric::size, "there must be one searcher for each term of the metric");
    auto sums = sum(current, pairs[0], metric_.template term<0>());
    [&]<std::size_t... I>(std::index_sequence<I...>) {
      ((sums += sum(current, pairs[I + 1], metric_.template term<I + 1>())), ...);
    }(std::make_index_sequence<N - 1>{});
    return solve(current, sums, count_sources<S>(pairs, surfaces_.source.points.size()));
  }

  /// The residual of each pair under a transform, unweighted, in the units of the points: with its
  /// sign if it has one row, otherwise its length. For a combined metric, the residual of all its
  /// terms together.
  [[nodiscard]] Eigen::VectorXd residuals(const transform_type& transform,
                                          std::span<const correspondence<S>> pairs) const {
    expects(index_t(transform.translation().size()) == surfaces_.dimension,
            "least_squares_estimator: transform and points must have the same dimension");
    expect_pairs_of(surfaces_, pairs);
    const affine_parts<double, C> current{transform};
    const auto turn = turn_of<Metric, Model>(current);
    Eigen::VectorXd values(std::ssize(pairs));
    parallel_for(std::ssize(pairs), how_, [&](index_t i) {
      const auto& [s, t, distance] = pairs[i];
      const auto pair = pair_in<Metric>(surfaces_, current, turn, s, t);
      double square = 0, last = 0;
      int rows = 0;
      with_terms(metric_, [&](const auto& term, const auto&...) {
        term(pair, [&](double value, const auto&...) {
          square += value * value;
          last = value;
          ++rows;
        });
      });
      values[i] = rows == 1 ? last : std::sqrt(square);
    });
    return values;
  }

 private:
  static constexpr int C = closed_dimension<D>;
  using sums_type = equation_sums<C, unknowns_of<Model, C>>;

  template <class Part>
  [[nodiscard]] sums_type sum(const transform_type& current,
                              std::span<const correspondence<S>> pairs, const Part& part) const {
    expects(index_t(current.translation().size()) == surfaces_.dimension,
            "least_squares_estimator: transform and points must have the same dimension");
    expect_pairs_of(surfaces_, pairs);
    return sum_equations<S, C, Part, Model>(surfaces_, affine_parts<double, C>{current}, pairs,
                                            part, model_, how_);
  }

  [[nodiscard]] registration_step<transform_type> solve(const transform_type& current,
                                                        const sums_type& sums,
                                                        index_t paired_sources) const {
    const velocity_field velocities = velocities_of(model_, surfaces_.dimension);
    const auto prepared = prepare_equations(sums, sums.place, sums.spread, sums.information,
                                            sums.gradient, velocities);
    const normal_solution solution = solver_(prepared.equations);
    auto step =
        step_to<transform_type>(model_, model_.step(solution.step, surfaces_.dimension),
                                affine_parts<double, C>{current}, surfaces_.center, prepared.mean);
    if (solution.step.isZero(0)) step.transform = current;
    step.fit = fit_of(sums, prepared, solution, velocities, surfaces_.center);
    step.fit.overlap = surfaces_.overlap(paired_sources);
    step.fit.non_finite = surfaces_.non_finite;
    return step;
  }

  registered_surfaces<S, C> surfaces_;
  Metric metric_;
  Model model_;
  Solver solver_;
  execution how_;
};
export template <PointsSource T, PointsSource P, class Metric = point_to_plane,
                 class Model = rigid_motion, class Solver = truncated_solver>
least_squares_estimator(T&&, P&&, Metric = {}, Model = {}, Solver = {}, execution = {})
    -> least_squares_estimator<scalar_of<T>, dimension_of<T>, Metric, Model, Solver>;

// The sums of the library's metrics are compiled in the library.
#define CILANTRO_COMPILED_ELSEWHERE(S, D, Metric, Model)                                 \
  extern template auto sum_equations<S, D, Metric, Model>(                               \
      const registered_surfaces<S, D>&, const affine_parts<double, D>&,                  \
      std::span<const correspondence<S>>, const Metric&, const Model&, const execution&) \
      -> equation_sums<D, unknowns_of<Model, D>>;
#define CILANTRO_FOR_METRICS(S, D)                                 \
  CILANTRO_COMPILED_ELSEWHERE(S, D, point_to_point, rigid_motion)  \
  CILANTRO_COMPILED_ELSEWHERE(S, D, point_to_point, affine_motion) \
  CILANTRO_COMPILED_ELSEWHERE(S, D, point_to_plane, rigid_motion)  \
  CILANTRO_COMPILED_ELSEWHERE(S, D, point_to_plane, affine_motion) \
  CILANTRO_COMPILED_ELSEWHERE(S, D, symmetric, rigid_motion)       \
  CILANTRO_COMPILED_ELSEWHERE(S, D, generalized_icp, rigid_motion)
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_FOR_METRICS)
#undef CILANTRO_FOR_METRICS
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
