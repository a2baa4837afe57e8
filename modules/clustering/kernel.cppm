// SPDX-License-Identifier: MIT
export module cilantro.clustering:kernel;

import cilantro.standard;

namespace cilantro {

/// The weight of a point at a distance of u bandwidths: finite, not negative, and not increasing
/// with u. Its member `support` is a number of bandwidths beyond which it is 0, so that points
/// farther away need not be looked at. Pure, and called from several threads at once.
/// Models: `flat_kernel`, `epanechnikov_kernel`, `gaussian_kernel`; with `custom_kernel`, any
/// lambda. `check_kernel` tests yours.
export template <class K>
concept Kernel = requires(const K& kernel, double u) {
  { kernel(u) } -> std::convertible_to<double>;
  { kernel.support } -> std::convertible_to<double>;
};

/// A kernel made from any `function` of u, cut off beyond `support`. If the support is infinite,
/// every step looks at all points.
export template <class F>
struct custom_kernel {
  F function;
  double support;
  double operator()(double u) const { return u <= support ? function(u) : 0; }
};
export template <class F>
custom_kernel(F, double) -> custom_kernel<F>;

/// 1 up to one bandwidth, so that all points there count alike. Mean shift with it climbs the
/// density of the Epanechnikov kernel.
export struct flat_kernel {
  static constexpr double support = 1;
  double operator()(double u) const { return u <= 1 ? 1 : 0; }
};

/// 1 − u² up to one bandwidth. Mean shift with it climbs the density of the biweight kernel (1 −
/// u²)².
export struct epanechnikov_kernel {
  static constexpr double support = 1;
  double operator()(double u) const { return u <= 1 ? 1 - u * u : 0; }
};

/// exp(−u² / 2), cut off at 4 bandwidths, where it is 0.0003. Mean shift with it climbs the density
/// of the Gaussian.
export struct gaussian_kernel {
  static constexpr double support = 4;
  double operator()(double u) const { return u <= support ? std::exp(-u * u / 2) : 0; }
};

static_assert(Kernel<flat_kernel> && Kernel<epanechnikov_kernel> && Kernel<gaussian_kernel>);

}  // namespace cilantro
