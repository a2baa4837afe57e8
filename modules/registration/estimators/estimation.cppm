// SPDX-License-Identifier: MIT
//
// What the estimators of the library share: the surfaces, and how sums over their pairs are turned
// into a step.
export module cilantro.registration:estimation;

import cilantro.standard;
import cilantro.core;
import :concepts;
import :correspondence;
import :motion;
import :normal_equations;

namespace cilantro {

namespace detail {
/// Points of any kind with their normals, in the dimension that the library is compiled for.
export template <Scalar S, int C, PointsSource P>
[[nodiscard]] oriented_points_view<S, C> oriented(const P& points) {
  return oriented_points_view<S, C>{points_view<S, C>{points_in(points)},
                                    points_view<S, C>{normals_in(points)}};
}

/// A rigid motion of more dimensions would have over 500 unknowns, whose equations are dense.
inline constexpr index_t most_dimensions = 32;

/// The two surfaces of a registration, and what is computed once for them.
export template <Scalar S, int D>
struct registered_surfaces {
  oriented_points_view<S, D> target, source;  ///< Viewed.
  index_t dimension = 0;                      ///< Of either that is not empty.
  index_t finite_sources = 0;                 ///< How many points of the source are finite.
  index_t non_finite = 0;                     ///< How many points of both are not.
  /// The centre of the target: sums around it lose little to rounding.
  point_vector<double, D> center;

  /// Throws `invalid_input` for sets of different dimension, and for more than 32 dimensions.
  registered_surfaces(const oriented_points_view<S, D>& onto,
                      const oriented_points_view<S, D>& moving)
      : target{onto}, source{moving} {
    expects(target.points.empty() || source.points.empty() ||
                target.points.dimension() == source.points.dimension(),
            "registration: target and source must have the same dimension");
    dimension = target.points.empty() ? source.points.dimension() : target.points.dimension();
    expects(dimension <= most_dimensions, "registration: points of " + std::to_string(dimension) +
                                              " coordinates have too many unknowns; at most " +
                                              std::to_string(most_dimensions) +
                                              " are taken. Is each point a column?");
    center = point_vector<double, D>::Zero(dimension);
    index_t finite_targets = 0;
    for (const auto& p : target.points)
      if (is_finite(p)) {
        center += p.template cast<double>();
        ++finite_targets;
      }
    if (finite_targets > 0) center /= double(finite_targets);
    finite_sources = source.points.size() - count_non_finite(source.points);
    non_finite = source.points.size() - finite_sources + target.points.size() - finite_targets;
  }
  /// The share of the finite source points that are paired.
  [[nodiscard]] double overlap(index_t paired_sources) const {
    return finite_sources > 0 ? double(paired_sources) / double(finite_sources) : 0;
  }
};

/// Throws `invalid_input` unless all pairs are of points of these surfaces: a searcher may have
/// been made of others.
export template <Scalar S, int D>
void expect_pairs_of(const registered_surfaces<S, D>& surfaces,
                     std::span<const correspondence<S>> pairs) {
  std::uint32_t last_source = 0, last_target = 0;  // What is negative is large.
  for (const auto& pair : pairs) {
    last_source = std::max(last_source, static_cast<std::uint32_t>(pair.source));
    last_target = std::max(last_target, static_cast<std::uint32_t>(pair.target));
  }
  expects(pairs.empty() || (std::cmp_less(last_source, surfaces.source.points.size()) &&
                            std::cmp_less(last_target, surfaces.target.points.size())),
          "registration: a pair is not of the points of the estimator; searcher and estimator must "
          "have the same source and target");
}
}  // namespace detail
using detail::expect_pairs_of;
using detail::oriented;
using detail::registered_surfaces;

/// The number of different source points in the pairs, which must be in order of source.
template <Scalar S>
[[nodiscard]] index_t count_sources(std::span<const correspondence<S>> pairs) {
  index_t count = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    count += i == 0 || pairs[i].source != pairs[i - 1].source;
  return count;
}
/// The same for several searches together.
template <Scalar S, std::size_t N>
[[nodiscard]] index_t count_sources(const std::array<correspondences<S>, N>& searches,
                                    index_t sources) {
  std::vector<bool> is_paired(sources);
  for (const auto& pairs : searches)
    for (const auto& pair : pairs) is_paired[pair.source] = true;
  index_t count = 0;
  for (const bool b : is_paired) count += b;
  return count;
}

namespace detail {
/// What is counted and summed of the pairs, whatever the dimension.
export struct pair_totals {
  index_t pairs = 0;  ///< How many.
  double weight = 0;  ///< The sum of their weights.
  /// The weights, times the largest squared gradient of each pair: less than its weight for a
  /// metric that trusts some pairs less.
  double seen = 0;
  double squared_residual = 0;  ///< The sum of the squared residuals, times the weights.
  double squared_distance = 0;  ///< The sum of the squared distances of the pairs, unweighted.

  pair_totals& operator+=(const pair_totals& other) {
    pairs += other.pairs;
    weight += other.weight;
    seen += other.seen;
    squared_residual += other.squared_residual;
    squared_distance += other.squared_distance;
    return *this;
  }
};
}  // namespace detail
using detail::pair_totals;

/// The weighted sums that all estimators need, around the centre of the target.
template <int D>
struct place_sums : pair_totals {
  point_vector<double, D> place;       ///< Of the moved source points.
  Eigen::Matrix<double, D, D> spread;  ///< Of their squares.

  explicit place_sums(index_t dimension)
      : place{point_vector<double, D>::Zero(dimension)},
        spread{Eigen::Matrix<double, D, D>::Zero(dimension, dimension)} {}
  place_sums& operator+=(const place_sums& other) {
    pair_totals::operator+=(other);
    place += other.place;
    spread += other.spread;
    return *this;
  }
  void add_place(double w, double largest_gradient, const point_vector<double, D>& p) {
    weight += w;
    seen += w * largest_gradient;
    place += w * p;
    spread += w * p * p.transpose();
  }
};

/// Sums of pairs as equations for a solver.
struct prepared_equations {
  normal_equations equations;
  Eigen::MatrixXd information;  ///< Not divided.
  Eigen::VectorXd mean;         ///< Of the moved source points, from the centre of the target.
};
[[nodiscard]] prepared_equations prepare_equations(const pair_totals& totals,
                                                   const Eigen::VectorXd& place,
                                                   const Eigen::MatrixXd& spread,
                                                   const Eigen::MatrixXd& lower_information,
                                                   const Eigen::VectorXd& gradient,
                                                   const velocity_field& velocities);

/// The fit in the target's own coordinates, of a solution around its centre.
[[nodiscard]] alignment_fit fit_of(const pair_totals& totals, const prepared_equations& prepared,
                                   const normal_solution& solution,
                                   const velocity_field& velocities, const Eigen::VectorXd& center);

/// A transform after a motion around `center`, in its parts, and how far that is.
struct moved_map {
  motion_step map;
  transform_change change;
};
[[nodiscard]] moved_map move_map(const motion_step& move, const Eigen::MatrixXd& linear,
                                 const Eigen::VectorXd& translation, const Eigen::VectorXd& center,
                                 const Eigen::VectorXd& mean);

/// The step that results from a motion around the centre; `fit` remains to be filled in.
template <class T, MotionModel Model, int D>
[[nodiscard]] registration_step<T> step_to(const Model& model, const motion_step& move,
                                           const affine_parts<double, D>& current,
                                           const Eigen::VectorXd& center,
                                           const Eigen::VectorXd& mean) {
  auto [map, change] = move_map(move, current.linear, current.translation, center, mean);
  // Both the source points and the transform are rounded.
  change.rounding = 2 * double(std::numeric_limits<typename T::Scalar>::epsilon()) *
                    (map.translation.norm() + (center + mean).norm());
  if constexpr (requires { model.normalize(map.linear); }) map.linear = model.normalize(map.linear);
  return {make_transform<T>(map.linear, map.translation), change, {}};
}

}  // namespace cilantro
