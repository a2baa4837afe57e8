// SPDX-License-Identifier: MIT
//
// Weights as functions of a distance or a residual. The robust ones are the weights of iteratively
// reweighted least squares, w(r) = ρ′(r) / r, scaled so that w(0) = 1.
export module cilantro.search:weight;

import cilantro.standard;
import cilantro.core;
import :pair;

namespace cilantro {

/// 1, whatever the distance.
export struct unit_weight {
  template <Scalar S>
  S operator()(S) const {
    return 1;
  }
};

/// The distance itself.
export struct distance_weight {
  template <Scalar S>
  S operator()(S distance) const {
    return distance;
  }
};

/// exp(−d² / 2σ²).
export struct gaussian {
  positive sigma;  ///< In the units of the distance.
  template <Scalar S>
  S operator()(S distance) const {
    const S ratio = distance / static_cast<S>(double(sigma));
    return std::exp(-ratio * ratio / 2);
  }
};

/// 1 up to the scale, then scale / |r|: quadratic near 0 and linear beyond.
/// Source: Huber 1964, "Robust estimation of a location parameter".
export struct huber {
  positive scale;  ///< In the units of the residual; 1.345 σ is usual.
  template <Scalar S>
  S operator()(S residual) const {
    const S ratio = std::abs(residual) / static_cast<S>(double(scale));
    return ratio <= 1 ? S(1) : 1 / ratio;
  }
};

/// (1 − (r / scale)²)², and 0 beyond the scale, where outliers have no influence at all.
/// Source: Beaton & Tukey 1974, "The fitting of power series", the biweight.
export struct tukey {
  positive scale;  ///< In the units of the residual; 4.685 σ is usual.
  template <Scalar S>
  S operator()(S residual) const {
    const S ratio = residual / static_cast<S>(double(scale));
    const S rest = 1 - ratio * ratio;
    return rest > 0 ? rest * rest : S(0);
  }
};

/// 1 / (1 + (r / scale)²).
/// Source: Zhang 1997, "Parameter estimation techniques", table 1, Cauchy (Lorentzian).
export struct cauchy {
  positive scale;  ///< In the units of the residual; 2.385 σ is usual.
  template <Scalar S>
  S operator()(S residual) const {
    const S ratio = residual / static_cast<S>(double(scale));
    return 1 / (1 + ratio * ratio);
  }
};

/// 1 / (1 + (r / scale)²)².
/// Source: Geman & McClure 1985; Zhang 1997, table 1, with a scale.
export struct geman_mcclure {
  positive scale;  ///< In the units of the residual.
  template <Scalar S>
  S operator()(S residual) const {
    const S weight = cauchy{scale}(residual);
    return weight * weight;
  }
};

/// exp(−(r / scale)²).
/// Source: Dennis & Welsch 1978, "Techniques for nonlinear least squares and robust regression";
/// Zhang 1997, table 1.
export struct welsch {
  positive scale;  ///< In the units of the residual; 2.985 σ is usual.
  template <Scalar S>
  S operator()(S residual) const {
    const S ratio = residual / static_cast<S>(double(scale));
    return std::exp(-ratio * ratio);
  }
};

/// A robust kernel of any type, for options: a function of a residual that returns its weight.
/// Empty by default, which weighs all residuals alike. A `Kernel`, which takes a number of
/// bandwidths, is not one.
export class robust_kernel {
 public:
  robust_kernel() = default;
  template <PairWeight<double> K>
    requires(!std::same_as<K, robust_kernel>) && std::is_invocable_r_v<double, const K&, double>
  robust_kernel(K kernel) : weight_{std::move(kernel)} {}  // NOLINT: a conversion on purpose

  [[nodiscard]] explicit operator bool() const { return weight_ != nullptr; }
  /// The weight; 1 if there is no kernel.
  double operator()(double residual) const { return weight_ ? weight_(residual) : 1; }

 private:
  std::function<double(double)> weight_;
};

static_assert(PairWeight<unit_weight, float> && PairWeight<gaussian, double>);

}  // namespace cilantro
