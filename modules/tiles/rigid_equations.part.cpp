// SPDX-License-Identifier: MIT
//
// A rigid motion from pairs that are summed up without rounding, in any order. Internal.
module cilantro.tiles:rigid_equations;

import cilantro.standard;
import cilantro.core;
import cilantro.eigen;
import cilantro.registration;

namespace cilantro {

/// What all pairs of a registration have together, with places relative to some centre.
template <int D>
struct pair_sums {
  static constexpr int unknowns = D * (D + 1) / 2;
  template <int N>
  using sums = std::array<exact_sum, N>;

  index_t sources = 0;  ///< The points that looked for a partner.
  index_t pairs = 0;
  exact_sum squared_distance, squared_residual, weight;
  exact_sum seen;  ///< The weights, each times the largest squared gradient of its pair.
  sums<D> place{}, target{};
  sums<D*(D + 1) / 2> spread{};  ///< Of places; the lower triangle, row by row.
  sums<D * D> product{};         ///< Target by place, row by row.
  sums<unknowns> gradient{};
  sums<unknowns*(unknowns + 1) / 2> information{};  ///< As `spread`.

  void add_distance(double square) {
    ++pairs;
    squared_distance += square;
  }
  /// The place of a moved point whose residuals are weighted.
  void add_place(double w, double largest_gradient, const point_vector<double, D>& y) {
    weight += w;
    seen.add_product(w, largest_gradient);
    for (int a = 0, k = 0; a < D; ++a) {
      place[a].add_product(w, y[a]);
      for (int b = 0; b <= a; ++b) spread[k++].add_product(w * y[a], y[b]);
    }
  }
  /// A residual and its derivatives by the unknowns.
  void add_row(double w, double value, const std::array<double, unknowns>& row) {
    squared_residual.add_product(w * value, value);
    for (int a = 0, k = 0; a < unknowns; ++a) {
      gradient[a].add_product(w * row[a], value);
      for (int b = 0; b <= a; ++b) information[k++].add_product(w * row[a], row[b]);
    }
  }
  /// A place and where it should be.
  void add_match(const point_vector<double, D>& y, const point_vector<double, D>& q) {
    for (int a = 0; a < D; ++a) {
      target[a] += q[a];
      for (int b = 0; b < D; ++b) product[a * D + b].add_product(q[a], y[b]);
    }
  }
  pair_sums& operator+=(const pair_sums& other) {
    sources += other.sources;
    pairs += other.pairs;
    squared_distance += other.squared_distance;
    squared_residual += other.squared_residual;
    weight += other.weight;
    seen += other.seen;
    add_each(place, other.place);
    add_each(target, other.target);
    add_each(spread, other.spread);
    add_each(product, other.product);
    add_each(gradient, other.gradient);
    add_each(information, other.information);
    return *this;
  }

 private:
  template <std::size_t N>
  static void add_each(std::array<exact_sum, N>& mine, const std::array<exact_sum, N>& theirs) {
    for (std::size_t k = 0; k < N; ++k) mine[k] += theirs[k];
  }
};

/// The step that pairs determine, as the estimators of `cilantro.registration` take it: in closed
/// form between points, or that of Gauss and Newton by rows.
template <int D>
class rigid_equations {
 public:
  using transform_type = rigid_transform<double, D>;

  rigid_equations(bool in_closed_form, const truncated_solver& solver,
                  const point_vector<double, D>& center, index_t non_finite)
      : in_closed_form_{in_closed_form},
        solver_{solver},
        center_{center},
        non_finite_{non_finite} {}

  [[nodiscard]] registration_step<transform_type> estimate(const transform_type& current,
                                                           const pair_sums<D>& sums) const {
    const double weight = sums.weight.value(), total = weight > 0 ? weight : 1;
    const vector mean = values_of<D>(sums.place) / total;
    const matrix covariance = symmetric_of<D>(sums.spread) / total - mean * mean.transpose();
    registration_step<transform_type> step{current, {}, {}};
    normal_equations equations;
    equations.motion = weight > 0 ? mean_square(mean, covariance) : square{square::Zero()};
    equations.gradient = Eigen::VectorXd::Zero(unknowns);
    square information;
    normal_solution solution;
    if (in_closed_form_) {
      const vector target = values_of<D>(sums.target) / total;
      matrix product;
      for (int a = 0; a < D; ++a)
        for (int b = 0; b < D; ++b) product(a, b) = sums.product[a * D + b].value();
      const matrix cross = product / total - target * mean.transpose();
      const matrix turn = nearest_rotation(cross);
      const matrix curved = turn.transpose() * cross;
      // How well a direction is determined, the cost tells: of a sphere, JᵀJ sees rotations.
      equations.information = mean_square(mean, (curved + curved.transpose()) / 2);
      information = weight * mean_square(mean, covariance);
      solution = solver_(equations);
      if (weight > 0) step = step_to(current, {turn, target - turn * mean}, mean);
    } else {
      const double seen = sums.seen.value() > 0 ? sums.seen.value() : 1;
      information = symmetric_of<unknowns>(sums.information);
      equations.information = information / seen;
      equations.gradient = values_of<unknowns>(sums.gradient) / seen;
      solution = solver_(equations);
      if (!solution.step.isZero(0)) {
        const auto move = rigid_motion::step(solution.step, D);
        step = step_to(current, {move.linear, move.translation}, mean);
      }
    }
    step.fit = fit_of(sums, information, solution);
    return step;
  }

 private:
  static constexpr int unknowns = pair_sums<D>::unknowns;
  using vector = point_vector<double, D>;
  using matrix = Eigen::Matrix<double, D, D>;
  using square = Eigen::Matrix<double, unknowns, unknowns>;
  using velocities = Eigen::Matrix<double, D, unknowns>;

  template <int N>
  static Eigen::Matrix<double, N, 1> values_of(const std::array<exact_sum, N>& sums) {
    Eigen::Matrix<double, N, 1> all;
    for (int a = 0; a < N; ++a) all[a] = sums[a].value();
    return all;
  }
  template <int N>
  static Eigen::Matrix<double, N, N> symmetric_of(
      const std::array<exact_sum, N*(N + 1) / 2>& sums) {
    Eigen::Matrix<double, N, N> all;
    for (int a = 0, k = 0; a < N; ++a)
      for (int b = 0; b <= a; ++b) all(a, b) = all(b, a) = sums[k++].value();
    return all;
  }

  /// How fast each unknown moves a point at y.
  static velocities velocities_at(const vector& y) {
    velocities all;
    for (int d = 0; d < D; ++d) {
      std::array<double, unknowns> row;
      rigid_motion::pull_back(y, vector{vector::Unit(d)}, row.data());
      for (int u = 0; u < unknowns; ++u) all(d, u) = row[u];
    }
    return all;
  }
  /// The mean of the squared velocities, over points of that mean and covariance.
  static square mean_square(const vector& mean, const matrix& covariance) {
    const velocities at_mean = velocities_at(mean), at_origin = velocities_at(vector::Zero());
    square sum = at_mean.transpose() * at_mean;
    for (int k = 0; k < D; ++k)
      for (int l = 0; l < D; ++l) {
        const velocities along_k = velocities_at(vector::Unit(k)) - at_origin;
        const velocities along_l = velocities_at(vector::Unit(l)) - at_origin;
        sum += covariance(k, l) * along_k.transpose() * along_l;
      }
    return sum;
  }
  /// Turns the unknowns of motions around the origin into those of the same motions around a
  /// centre.
  static square recentering(const vector& center) {
    square all = square::Identity();
    all.template bottomRows<D>() = velocities_at(center);
    return all;
  }

  [[nodiscard]] registration_step<transform_type> step_to(const transform_type& current,
                                                          const affine_parts<double, D>& move,
                                                          const vector& mean) const {
    const matrix linear = move.linear * current.linear();
    const vector translation =
        center_ + move.linear * (vector{current.translation()} - center_) + move.translation;
    transform_change change{angle_of(move.linear), (move(mean) - mean).norm()};
    change.rounding =
        2 * std::numeric_limits<double>::epsilon() * (translation.norm() + (center_ + mean).norm());
    return {make_transform<transform_type>(nearest_rotation(linear), translation), change, {}};
  }
  /// ‖R − I‖ = √8 sin(θ/2).
  static double angle_of(const matrix& rotation) {
    return 2 * std::asin(std::fmin(1, (rotation - matrix::Identity()).norm() / std::sqrt(8.0)));
  }

  [[nodiscard]] alignment_fit fit_of(const pair_sums<D>& sums, const square& information,
                                     const normal_solution& solution) const {
    const auto share = [](double part, double whole) { return whole > 0 ? part / whole : 0.0; };
    alignment_fit fit;
    fit.pairs = sums.pairs;
    fit.overlap = share(double(sums.pairs), double(sums.sources));
    fit.rmse = std::sqrt(share(sums.squared_distance.value(), double(sums.pairs)));
    fit.residual = std::sqrt(share(sums.squared_residual.value(), sums.weight.value()));
    fit.non_finite = non_finite_;
    fit.unknowns = unknowns;
    const square to_center = recentering(center_);
    fit.information = to_center.transpose() * information * to_center;
    fit.directions = recentering(-center_) * solution.directions;
    fit.eigenvalues = solution.eigenvalues.cwiseMin(1);
    fit.undetermined = solution.undetermined;
    return fit;
  }

  bool in_closed_form_;
  truncated_solver solver_;
  vector center_;
  index_t non_finite_;
};

}  // namespace cilantro
