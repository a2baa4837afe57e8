// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
export module cilantro.registration:point_to_point;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :concepts;
import :correspondence;
import :estimation;
import :motion;
import :normal_equations;

namespace cilantro {

/// The sums that determine the closed form.
template <int D>
struct match_sums : place_sums<D> {
  point_vector<double, D> target;
  Eigen::Matrix<double, D, D> product;  ///< Σ w q yᵀ, target by moved source.

  explicit match_sums(index_t dimension)
      : place_sums<D>{dimension},
        target{point_vector<double, D>::Zero(dimension)},
        product{Eigen::Matrix<double, D, D>::Zero(dimension, dimension)} {}
  match_sums& operator+=(const match_sums& other) {
    place_sums<D>::operator+=(other);
    target += other.target;
    product += other.product;
    return *this;
  }
};

template <Scalar S, int D, class Weight>
[[nodiscard]] match_sums<D> sum_matches(const registered_surfaces<S, D>& surfaces,
                                        const affine_parts<double, D>& current,
                                        std::span<const correspondence<S>> pairs,
                                        const Weight& weight, const execution& how) {
  const auto& [target, source, dimension, finite_sources, non_finite, center] = surfaces;
  return ordered_sum(std::ssize(pairs), how, match_sums<D>{dimension}, [&](auto& sums, index_t i) {
    const auto& [s, t, found_distance] = pairs[i];
    const point_vector<double, D> y = current(source.points[s]) - center;
    const point_vector<double, D> q = target.points[t].template cast<double>() - center;
    const double square = (y - q).squaredNorm();
    if (!std::isfinite(square)) return;
    ++sums.pairs;
    sums.squared_distance += square;
    const double w = double(evaluate_pair<double>(weight, s, t, std::sqrt(square)));
    if (!(w > 0)) return;
    sums.squared_residual += w * square;
    sums.add_place(w, 1, y);
    sums.target += w * q;
    sums.product += w * q * y.transpose();
  });
}

/// The motion that best brings the moved source points onto their targets, leaving what is not
/// determined as it is; and the equations that it solves.
struct matched_motion {
  motion_step move;
  prepared_equations prepared;
};
template <class Model>
[[nodiscard]] matched_motion solve_matches(const Model& model, const pair_totals& totals,
                                           const Eigen::VectorXd& place,
                                           const Eigen::MatrixXd& spread,
                                           const Eigen::VectorXd& target,
                                           const Eigen::MatrixXd& product,
                                           const velocity_field& velocities);

/// Computes the least-squares transform between the points of the pairs in closed form, in any
/// dimension: rigid (Umeyama 1991, "Least-squares estimation of transformation parameters",
/// equations 34 to 43, without scale), or affine by its normal equations. A rigid transform is
/// never a reflection.
///
/// Whatever the pairs do not determine, such as the rotation about a line on which all points lie,
/// stays as it is. `Weight` is a `PairWeight` of source index, target index, and the distance
/// between the two under the current transform, so that it can be a robust kernel. Views target and
/// source, which must outlive it.
export template <Scalar S, int D, class Model = rigid_motion,
                 PairWeight<double> Weight = unit_weight>
  requires std::same_as<Model, rigid_motion> || std::same_as<Model, affine_motion>
class point_to_point_estimator {
 public:
  using transform_type = transform_of<Model, S, D>;

  /// Throws `invalid_input` for surfaces of different dimension or origin.
  template <BorrowedPoints T, BorrowedPoints P>
  point_to_point_estimator(P&& source, T&& target, Model model = {}, Weight weight = {},
                           truncated_solver solver = {}, execution how = {})
      : surfaces_{oriented_points_view<S, C>{points_view<S, C>{as_points(target)}},
                  oriented_points_view<S, C>{points_view<S, C>{as_points(source)}}},
        model_{model},
        weight_{std::move(weight)},
        solver_{solver},
        how_{std::move(how)} {
    expect_same_origin(source, target, "point_to_point_estimator");
    expect_sizes(weight_, surfaces_.source.points.size(), surfaces_.target.points.size(),
                 "point_to_point_estimator");
  }

  /// The identity, in the dimension of the surfaces.
  [[nodiscard]] transform_type identity() const {
    return identity_transform<transform_type>(surfaces_.dimension);
  }

  /// As `TransformEstimator` says. Throws `invalid_input` for a transform of another dimension.
  /// O(pairs · D²).
  [[nodiscard]] registration_step<transform_type> estimate(
      const transform_type& current, std::span<const correspondence<S>> pairs) const {
    expects(index_t(current.translation().size()) == surfaces_.dimension,
            "point_to_point_estimator: transform and points must have the same dimension");
    expect_pairs_of(surfaces_, pairs);
    const affine_parts<double, C> map{current};
    const match_sums<C> sums = sum_matches<S, C, Weight>(surfaces_, map, pairs, weight_, how_);
    const velocity_field velocities = velocities_of(model_, surfaces_.dimension);
    const auto matched =
        solve_matches(model_, sums, sums.place, sums.spread, sums.target, sums.product, velocities);
    registration_step<transform_type> step{current, {}, {}};
    if (sums.weight > 0)
      step = step_to<transform_type>(model_, matched.move, map, surfaces_.center,
                                     matched.prepared.mean);
    step.fit = fit_of(sums, matched.prepared, solver_(matched.prepared.equations), velocities,
                      surfaces_.center);
    step.fit.overlap = surfaces_.overlap(count_sources<S>(pairs));
    step.fit.non_finite = surfaces_.non_finite;
    return step;
  }

  /// The distance between the points of each pair under a transform.
  [[nodiscard]] Eigen::VectorXd residuals(const transform_type& transform,
                                          std::span<const correspondence<S>> pairs) const {
    expects(index_t(transform.translation().size()) == surfaces_.dimension,
            "point_to_point_estimator: transform and points must have the same dimension");
    expect_pairs_of(surfaces_, pairs);
    const affine_parts<double, C> current{transform};
    Eigen::VectorXd values(std::ssize(pairs));
    parallel_for(std::ssize(pairs), how_, [&](index_t i) {
      const auto& [s, t, distance] = pairs[i];
      values[i] =
          (current(surfaces_.source.points[s]) - surfaces_.target.points[t].template cast<double>())
              .norm();
    });
    return values;
  }

 private:
  static constexpr int C = closed_dimension<D>;
  registered_surfaces<S, C> surfaces_;
  Model model_;
  Weight weight_;
  truncated_solver solver_;
  execution how_;
};
export template <PointsSource T, PointsSource P, class Model = rigid_motion,
                 class Weight = unit_weight>
point_to_point_estimator(T&&, P&&, Model = {}, Weight = {}, truncated_solver = {}, execution = {})
    -> point_to_point_estimator<scalar_of<T>, dimension_of<T>, Model, Weight>;

#define CILANTRO_COMPILED_ELSEWHERE(S, D)                               \
  extern template match_sums<D> sum_matches<S, D, unit_weight>(         \
      const registered_surfaces<S, D>&, const affine_parts<double, D>&, \
      std::span<const correspondence<S>>, const unit_weight&, const execution&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
