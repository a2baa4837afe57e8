// SPDX-License-Identifier: MIT
module cilantro.geometry;

namespace cilantro {
namespace {

/// The lower incomplete gamma function over Γ(a), by its series below a + 1 and by the continued
/// fraction of its complement above. Source: Abramowitz & Stegun 6.5.29 and 6.5.31.
double regularized_gamma(double a, double x) {
  if (!(x > 0)) return 0;
  if (std::isinf(x)) return 1;
  constexpr double epsilon = std::numeric_limits<double>::epsilon();
  const double front = std::exp(a * std::log(x) - x - std::lgamma(a));
  if (x < a + 1) {
    double term = 1 / a, sum = term;
    for (double n = a + 1; term > sum * epsilon; ++n) sum += term *= x / n;
    return front * sum;
  }
  // Lentz's method from the front: f = b₀ + a₁ / (b₁ + a₂ / (b₂ + …)).
  double b = x + 1 - a, c = std::numeric_limits<double>::max(), d = 1 / b, f = d;
  for (int n = 1; n < 10000; ++n) {
    const double an = -n * (n - a);
    b += 2;
    d = 1 / (an * d + b);
    c = b + an / c;
    f *= d * c;
    if (std::abs(d * c - 1) < epsilon) break;
  }
  return 1 - front * f;
}

}  // namespace

double chi_square_probability(double x, index_t degrees_of_freedom) {
  expects(!std::isnan(x), "chi_square_probability: x must be a number");
  expect_from(1, double(degrees_of_freedom), "chi_square_probability: the degrees of freedom");
  return regularized_gamma(double(degrees_of_freedom) / 2, x / 2);
}

double chi_square_quantile(double p, index_t degrees_of_freedom) {
  expects(p > 0 && p < 1,
          "chi_square_quantile: p must be above 0 and below 1, and is " + in_digits(p));
  expect_from(1, double(degrees_of_freedom), "chi_square_quantile: the degrees of freedom");
  const double a = double(degrees_of_freedom) / 2;
  double low = 0, high = double(degrees_of_freedom);
  while (chi_square_probability(high, degrees_of_freedom) < p) high *= 2;
  // Newton's steps, kept within what is known to hold the answer.
  double x = (low + high) / 2;
  for (int i = 0; i < 200 && high - low > 1e-12 * high; ++i) {
    const double excess = chi_square_probability(x, degrees_of_freedom) - p;
    (excess > 0 ? high : low) = x;
    const double density = std::exp((a - 1) * std::log(x / 2) - x / 2 - std::lgamma(a)) / 2;
    const double next = x - excess / density;
    if (std::abs(next - x) < 1e-13 * x) return next;
    x = next > low && next < high ? next : (low + high) / 2;
  }
  return x;
}

}  // namespace cilantro
