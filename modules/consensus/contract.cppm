// SPDX-License-Identifier: MIT
export module cilantro.consensus:contract;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :ransac;

namespace cilantro {

/// Tests a family of models of yours on samples of its own data: that fitting a sample twice gives
/// the same model; that residuals are not negative, agree between `residual`, `residuals` and
/// `score`, and are at most `tolerance` within a minimal sample, unless such samples are
/// `overdetermined`; and that a sample of one datum repeated is degenerate. Returns a sentence for
/// each rule that is broken; if there is none, the family can be used. `tolerance` is in the units
/// of the residuals.
export template <ModelFamily F>
[[nodiscard]] std::vector<std::string> check_model_family(const F& family, double tolerance,
                                                          bool overdetermined = false,
                                                          const contract_options& options = {}) {
  violation_list violations;
  const index_t n = family.size(), m = family.sample_size();
  violations.expect(m > 0, "sample_size() is not positive");
  if (!violations.empty() || n < m) return violations.take();
  const auto residuals_of = [&](const auto& model) {
    std::vector<double> all;
    for (index_t i = 0; i < n; ++i) all.push_back(family.residual(model, i));
    return all;
  };
  for (index_t q = 0; q < options.queries; ++q) {
    const auto sample =
        distinct_sample(n, m, random_stream{options.seed, static_cast<std::uint64_t>(q)});
    const auto model = family.fit(sample);
    if (!model) continue;
    const auto again = family.fit(sample);
    violations.expect(bool(again), "a sample is degenerate the second time");
    if (!again) continue;
    const auto residuals = residuals_of(*model), others = residuals_of(*again);
    for (index_t i = 0; i < n; ++i) {
      const auto at = static_cast<std::size_t>(i);
      violations.expect(residuals[at] >= 0 || std::isnan(residuals[at]), "a residual is negative");
      violations.expect(residuals[at] == others[at] || std::isnan(residuals[at]),
                        "two fits to the same sample differ");
    }
    for (const index_t i : sample)
      violations.expect(overdetermined || residuals[i] <= tolerance,
                        "a model does not go through its sample");
    if constexpr (requires { typename F::scalar; }) {
      using S = typename F::scalar;
      std::vector<S> block(n);
      family.residuals(*model, 0, std::span<S>{block});
      for (std::size_t i = 0; i < block.size(); ++i)
        violations.expect(std::isnan(block[i]) == std::isnan(residuals[i]) &&
                              !(std::abs(double(block[i]) - residuals[i]) > tolerance),
                          "residuals() and residual() give different results");
    }
    if constexpr (ScoresModels<F>) {
      // The limit lies between two residuals that are clearly apart, so that rounding does not
      // matter.
      auto sorted = residuals;
      std::erase_if(sorted, [](double r) { return std::isnan(r); });
      std::ranges::sort(sorted);
      for (std::size_t k = sorted.size() / 2; k + 1 < sorted.size(); ++k) {
        if (!(sorted[k + 1] - sorted[k] > 2 * tolerance)) continue;
        data_score sum;
        family.score(std::span{&*model, 1}, 0, n,
                     {(sorted[k] + sorted[k + 1]) / 2, ransac_score::inliers}, std::span{&sum, 1});
        violations.expect(sum.inliers == static_cast<index_t>(k) + 1,
                          "score() and residual() give different results");
        break;
      }
    }
  }
  if (m > 1) {
    const index_list same(static_cast<std::size_t>(m), 0);
    violations.expect(!family.fit(same), "a sample of one repeated datum is not degenerate");
  }
  return violations.take();
}

}  // namespace cilantro
