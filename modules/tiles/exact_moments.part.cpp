// SPDX-License-Identifier: MIT
//
// Means and covariances of points in any order, without rounding until the end. Internal.
module cilantro.tiles:exact_moments;

import cilantro.standard;
import cilantro.core;
import cilantro.eigen;

namespace cilantro {

/// The doubles that add up to a sum: it, rounded, what was lost by that, rounded, and so on. A few;
/// one, if it is infinite or NaN.
inline std::vector<double> expansion_of(exact_sum sum) {
  std::vector<double> terms;
  while (sum.value() != 0) {
    terms.push_back(sum.value());
    if (!std::isfinite(terms.back())) break;
    sum += -terms.back();
  }
  return terms;
}

/// The sum of (a - mean of a) (b - mean of b), rounded once and divided, from sums of n pairs.
inline double centered_product(index_t n, const exact_sum& a, const exact_sum& b,
                               const exact_sum& products) {
  // n Σab - Σa Σb: nothing is lost where all are nearly the same.
  exact_sum scatter;
  for (const double term : expansion_of(products)) scatter.add_product(double(n), term);
  const auto of_b = expansion_of(b);
  for (const double s : expansion_of(a))
    for (const double t : of_b) scatter.add_product(-s, t);
  return scatter.value() / double(n);
}

/// The sums of D numbers each and of their products, of which mean and covariance are made.
template <int D>
struct moment_sums {
  index_t count = 0;
  std::array<exact_sum, D> sums{};
  std::array<exact_sum, D*(D + 1) / 2> products{};  ///< Of a and b ≤ a, row by row.

  template <class P>
  void add(const P& point) {
    ++count;
    auto product = products.begin();
    for (int a = 0; a < D; ++a) {
      sums[a] += double(point[a]);
      for (int b = 0; b <= a; ++b) (product++)->add_product(double(point[a]), double(point[b]));
    }
  }
  moment_sums& operator+=(const moment_sums& other) {
    count += other.count;
    for (std::size_t k = 0; k < sums.size(); ++k) sums[k] += other.sums[k];
    for (std::size_t k = 0; k < products.size(); ++k) products[k] += other.products[k];
    return *this;
  }
  bool operator==(const moment_sums&) const = default;

  /// Precondition: there are points.
  [[nodiscard]] Eigen::Matrix<double, D, 1> mean() const {
    Eigen::Matrix<double, D, 1> all;
    for (int a = 0; a < D; ++a) all[a] = sums[a].value() / double(count);
    return all;
  }
  /// Divided by count - 1; zero for a single point.
  [[nodiscard]] Eigen::Matrix<double, D, D> covariance() const {
    Eigen::Matrix<double, D, D> all = Eigen::Matrix<double, D, D>::Zero();
    if (count < 2) return all;
    auto product = products.begin();
    for (int a = 0; a < D; ++a)
      for (int b = 0; b <= a; ++b)
        all(a, b) = all(b, a) =
            centered_product(count, sums[a], sums[b], *product++) / double(count - 1);
    return all;
  }
};

}  // namespace cilantro
