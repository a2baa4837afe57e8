// SPDX-License-Identifier: MIT
//
// The largest ball in an intersection of half-spaces, by a dual simplex whose basis has dimension +
// 1 columns. Its radius tells all cases apart: below 0 the half-spaces contradict each other, 0 is
// a set without an inside.
module cilantro.spatial:linear_program;

import cilantro.standard;
import cilantro.core;
import cilantro.eigen;

namespace cilantro {

/// What `largest_ball` returns.
struct ball_in_half_spaces {
  Eigen::VectorXd center;
  double radius = 0;           ///< Below 0: the least violation that a point must have.
  std::vector<index_t> tight;  ///< The half-spaces that determine the ball.
  bool touches_bound = false;  ///< Whether the bound determines it, too.
  bool is_right = true;        ///< Whether all half-spaces hold at the end.
};

namespace {

/// A smaller pivot is taken for rounding.
constexpr double least_pivot = 1e-9;
/// Of the bound, which is 1 here.
constexpr double optimal = 1e-14;
/// From here on the rule of Bland, which cannot cycle.
constexpr int hasty_pivots = 200;
constexpr int most_pivots = 5000;

/// The inverse by Gauss and Jordan with partial pivoting, in place; false if there is none.
bool invert(Eigen::MatrixXd& a, Eigen::MatrixXd& inverse) {
  const index_t n = a.rows();
  inverse.setIdentity(n, n);
  for (index_t k = 0; k < n; ++k) {
    index_t best = k;
    for (index_t i = k + 1; i < n; ++i)
      if (std::abs(a(i, k)) > std::abs(a(best, k))) best = i;
    if (!(std::abs(a(best, k)) > 0)) return false;
    for (index_t j = 0; j < n && best != k; ++j) {
      std::swap(a(k, j), a(best, j));
      std::swap(inverse(k, j), inverse(best, j));
    }
    const double pivot = 1 / a(k, k);
    for (index_t j = 0; j < n; ++j) {
      a(k, j) *= pivot;
      inverse(k, j) *= pivot;
    }
    for (index_t i = 0; i < n; ++i) {
      const double factor = a(i, k);
      if (i == k || factor == 0) continue;
      for (index_t j = 0; j < n; ++j) {
        a(i, j) -= factor * a(k, j);
        inverse(i, j) -= factor * inverse(k, j);
      }
    }
  }
  return true;
}

/// max r with normal · x + r <= offset for all and |x|, r <= bound: columns (normal, 1) with costs
/// offset, and 2 · dimension + 1 for the bound. Its dual starts from the bound's columns.
class dual_simplex {
 public:
  dual_simplex(const Eigen::MatrixXd& normals, const Eigen::VectorXd& offsets, double bound)
      : normals_{normals},
        rows_{normals.transpose()},
        offsets_{offsets},
        bound_{bound},
        d_{normals.rows()},
        n_{normals.cols()},
        basis_(d_ + 1),
        y_{Eigen::VectorXd::Unit(d_ + 1, d_)},
        inverse_{Eigen::MatrixXd::Identity(d_ + 1, d_ + 1)} {
    for (index_t j = 0; j <= d_; ++j) basis_[j] = n_ + (j == d_ ? 2 * d_ : 2 * j);
  }

  ball_in_half_spaces solve() {
    for (int pivots = 0; pivots < most_pivots; ++pivots) {
      price();
      const index_t entering = find_entering(pivots < hasty_pivots);
      if (entering < 0 || !pivot(entering, pivots < hasty_pivots)) break;
    }
    ball_in_half_spaces found{.center = z_.head(d_), .radius = z_[d_]};
    for (index_t k = 0; k <= d_; ++k)
      if (y_[k] > least_pivot) {
        if (basis_[k] < n_)
          found.tight.push_back(basis_[k]);
        else
          found.touches_bound = true;
      }
    std::ranges::sort(found.tight);
    return found;
  }

 private:
  [[nodiscard]] double cost(index_t column) const {
    return column < n_ ? offsets_[column] : bound_;
  }
  [[nodiscard]] Eigen::VectorXd column(index_t c) const {
    Eigen::VectorXd values = Eigen::VectorXd::Zero(d_ + 1);
    if (c < n_) {
      values.head(d_) = normals_.col(c);
      values[d_] = 1;
    } else if (c == n_ + 2 * d_) {
      values[d_] = 1;
    } else {
      values[(c - n_) / 2] = (c - n_) % 2 == 0 ? 1 : -1;
    }
    return values;
  }

  void price() {
    z_ = Eigen::VectorXd::Zero(d_ + 1);
    for (index_t k = 0; k <= d_; ++k) z_ += cost(basis_[k]) * inverse_.row(k).transpose();
    reduced_ = offsets_;
    for (index_t j = 0; j < d_; ++j) reduced_ -= z_[j] * rows_.col(j);
    reduced_.array() -= z_[d_];
  }
  [[nodiscard]] double reduced_cost(index_t c) const {
    if (c < n_) return reduced_[c];
    if (c == n_ + 2 * d_) return bound_ - z_[d_];
    return bound_ - ((c - n_) % 2 == 0 ? z_[(c - n_) / 2] : -z_[(c - n_) / 2]);
  }

  [[nodiscard]] bool is_violated(index_t c) const {
    return reduced_cost(c) < -optimal * (1 + std::abs(cost(c)));
  }
  [[nodiscard]] index_t find_entering(bool hasty) const {
    const index_t columns = n_ + 2 * d_ + 1;
    index_t best = -1, first = 0;
    double least = 0;
    if (hasty && n_ > 0) {
      // The least of all half-spaces is found by vectors, and mostly says it: it counts, or none
      // does.
      const double lowest = reduced_.minCoeff();
      const index_t at = std::find(reduced_.begin(), reduced_.end(), lowest) - reduced_.begin();
      if (lowest >= -optimal) {
        first = n_;
      } else if (at < n_ && is_violated(at)) {
        best = at;
        least = lowest;
        first = n_;
      }
    }
    for (index_t c = first; c < columns; ++c) {
      if (!is_violated(c)) continue;
      if (!hasty) return c;
      const double value = reduced_cost(c);
      if (best < 0 || value < least) {
        best = c;
        least = value;
      }
    }
    return best;
  }

  [[nodiscard]] bool pivot(index_t entering, bool hasty) {
    const Eigen::VectorXd direction = inverse_ * column(entering);
    index_t leaving = -1;
    double step = std::numeric_limits<double>::infinity();
    for (index_t k = 0; k <= d_; ++k) {
      if (direction[k] <= least_pivot) continue;
      const double ratio = std::max(0.0, y_[k]) / direction[k];
      const bool better_of_equals =
          leaving < 0 || (hasty ? direction[k] > direction[leaving] : basis_[k] < basis_[leaving]);
      if (ratio < step - 1e-12 || (ratio <= step + 1e-12 && better_of_equals)) {
        step = std::min(step, ratio);
        leaving = k;
      }
    }
    if (leaving < 0) return false;
    const index_t left = basis_[leaving];
    basis_[leaving] = entering;
    // Updating the inverse is as fast, and was wrong in 15 of 320,000 degenerate sets.
    Eigen::MatrixXd columns(d_ + 1, d_ + 1), inverse;
    for (index_t k = 0; k <= d_; ++k) columns.col(k) = column(basis_[k]);
    if (!invert(columns, inverse)) {
      basis_[leaving] = left;
      return false;
    }
    inverse_ = std::move(inverse);
    y_ = inverse_.col(d_);
    return true;
  }

  const Eigen::MatrixXd& normals_;
  Eigen::MatrixXd rows_;  ///< An axis after the other, as pricing reads them.
  const Eigen::VectorXd& offsets_;
  double bound_;
  index_t d_, n_;
  std::vector<index_t> basis_;
  Eigen::VectorXd y_, z_, reduced_;
  Eigen::MatrixXd inverse_;
};

}  // namespace

/// The largest ball with normal · x + radius <= offset for all half-spaces, and |xⱼ|, radius <=
/// `bound`. Normals have unit length, one per column. O(dimension · n) a pivot, of which 3 to 11
/// are usual. Chebyshev centre: Boyd and Vandenberghe, Convex Optimization, 2004, section 4.3.1.
ball_in_half_spaces largest_ball(const Eigen::MatrixXd& normals, const Eigen::VectorXd& offsets,
                                 double bound) {
  // In units of the bound, so that rounding is what it is elsewhere.
  const Eigen::VectorXd unit_offsets = offsets / bound;
  ball_in_half_spaces best;
  double least_violation = std::numeric_limits<double>::infinity();
  for (int attempt = 0; attempt < 3; ++attempt) {
    // Degenerate sets, in which pivots may go in circles, are none after a change of the offsets
    // below the tolerance.
    Eigen::VectorXd changed = unit_offsets;
    for (index_t i = 0; i < changed.size() && attempt > 0; ++i)
      changed[i] += 1e-14 * attempt * double(i * 7919 % 1009) / 1009;
    auto found = dual_simplex{normals, changed, 1}.solve();
    double violation = std::max(0.0, found.center.cwiseAbs().maxCoeff() - 1);
    if (normals.cols() > 0) {
      const double inside = (unit_offsets - normals.transpose() * found.center).minCoeff();
      violation = std::max(violation, found.radius - inside);
    }
    if (violation < least_violation) {
      least_violation = violation;
      best = std::move(found);
    }
    if (least_violation <= 1e-13) break;
  }
  best.is_right = least_violation <= 1e-9;
  best.center *= bound;
  best.radius *= bound;
  return best;
}

/// As above, with a bound that grows as long as it keeps the ball from a radius above `enough`: the
/// set may be far away. Throws `std::runtime_error` if the result does not hold.
ball_in_half_spaces ball_anywhere(const Eigen::MatrixXd& normals, const Eigen::VectorXd& offsets,
                                  double bound, double enough) {
  for (int growth = 0;; ++growth) {
    auto found = largest_ball(normals, offsets, bound);
    if (!found.is_right)
      throw std::runtime_error{"half-spaces: the linear program of the inner ball was not solved"};
    if (found.radius > enough || !found.touches_bound || growth == 4) return found;
    bound *= 1000;
  }
}

}  // namespace cilantro
