// SPDX-License-Identifier: MIT
//
// What a robust kernel makes of the chi-squares of edges.
module cilantro.registration:edge_kernel;

import cilantro.standard;
import cilantro.core;
import cilantro.search;

namespace cilantro {

/// A robust kernel of the root of a chi-square that ends where the weight falls below a limit.
class edge_kernel {
 public:
  edge_kernel(const robust_kernel& kernel, double min_weight)
      : kernel_{kernel}, end_{reach(min_weight)} {}

  /// The largest root of a chi-square that has any weight.
  [[nodiscard]] double end() const { return end_; }

  [[nodiscard]] double weight(double chi) const { return chi <= end_ ? checked(chi) : 0.0; }

  /// The largest root of a chi-square whose weight is at least this, for weights that fall; ∞ if
  /// all are.
  [[nodiscard]] double reach(double least_weight) const {
    double within = 1e-9, beyond = 1e12;
    if (!kernel_ || checked(beyond) >= least_weight) return std::numeric_limits<double>::infinity();
    expects(checked(within) >= least_weight,
            "optimize_poses: .robust gives even edges that agree less weight than .min_weight");
    for (int halving = 0; halving < 200; ++halving) {
      const double middle = std::sqrt(within * beyond);
      (checked(middle) >= least_weight ? within : beyond) = middle;
    }
    return within;
  }

  /// What an edge costs: the integral of its weight over the chi-square.
  [[nodiscard]] double cost(double chi_square) const {
    if (!kernel_) return chi_square;
    // By Gauss's rule in each octave below; what is left is too small to be seen.
    constexpr std::array places{-0.9061798459386640, -0.5384693101056831, 0.0, 0.5384693101056831,
                                0.9061798459386640};
    constexpr std::array shares{0.2369268850561891, 0.4786286704993665, 0.5688888888888889,
                                0.4786286704993665, 0.2369268850561891};
    double high = std::min(chi_square, end_ * end_), sum = 0;
    for (int octave = 0; octave < 50; ++octave, high /= 2)
      for (std::size_t i = 0; i < places.size(); ++i)
        sum += shares[i] * high / 4 * checked(std::sqrt(high * (0.75 + 0.25 * places[i])));
    return sum;
  }

 private:
  [[nodiscard]] double checked(double chi) const {
    const double weight = kernel_(chi);
    expects(weight >= 0 && std::isfinite(weight),
            "optimize_poses: .robust gives a weight that is negative or not finite");
    return weight;
  }

  const robust_kernel& kernel_;
  double end_;
};

}  // namespace cilantro
