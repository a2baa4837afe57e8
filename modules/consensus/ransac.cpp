// SPDX-License-Identifier: MIT
module cilantro.consensus;

namespace cilantro {

namespace {

/// How many are at most `limit`, and what they count.
template <bool ByResidual, Scalar S, class Counts>
data_score score_in_lanes(std::span<const S> residuals, S limit, S scale, Counts counts) {
  // Sums in lanes, in an order that does not depend on the machine and that vectors can follow.
  constexpr std::size_t lanes = 16;
  std::array<S, lanes> sum{}, count{};
  const auto add = [&](std::size_t lane, std::size_t k) {
    const S r = residuals[k];
    const bool agrees = r <= limit && counts(k);
    count[lane] += agrees ? S(1) : S(0);
    if constexpr (ByResidual) sum[lane] += agrees ? 1 - r * r * scale : S(0);
  };
  const std::size_t whole = residuals.size() / lanes * lanes;
  for (std::size_t k = 0; k < whole; k += lanes)
    for (std::size_t lane = 0; lane < lanes; ++lane) add(lane, k + lane);
  for (std::size_t k = whole; k < residuals.size(); ++k) add(k - whole, k);
  double agreeing = 0, value = 0;
  for (const S c : count) agreeing += double(c);
  for (const S s : sum) value += double(s);
  return {static_cast<index_t>(agreeing), ByResidual ? value : agreeing};
}

}  // namespace

template <Scalar S>
scoring_limits<S> limits_of(const residual_scoring& scoring) {
  S limit = static_cast<S>(scoring.max_residual);
  if (double(limit) > scoring.max_residual) limit = std::nextafter(limit, S(0));
  if (scoring.by == ransac_score::inliers) return {limit, 0};
  const double scale = 1 / (scoring.max_residual * scoring.max_residual);
  return {limit, static_cast<S>(std::min(scale, double(std::numeric_limits<S>::max())))};
}
template scoring_limits<float> limits_of(const residual_scoring&);
template scoring_limits<double> limits_of(const residual_scoring&);

template <Scalar S>
data_score score_of(std::span<const S> residuals, const residual_scoring& scoring) {
  const auto [limit, scale] = limits_of<S>(scoring);
  const auto score = [&](auto counts) {
    return scale > 0 ? score_in_lanes<true>(residuals, limit, scale, counts)
                     : score_in_lanes<false>(residuals, limit, scale, counts);
  };
  if (scoring.active.empty()) return score([](std::size_t) { return true; });
  return score([&](std::size_t k) { return scoring.active[k] != 0; });
}
template data_score score_of(std::span<const float>, const residual_scoring&);
template data_score score_of(std::span<const double>, const residual_scoring&);

void expect_sensible(const ransac_options& options) {
  expects(
      options.confidence > 0 && options.confidence <= 1,
      "ransac: confidence must be above 0, and at most 1, and is " + in_digits(options.confidence));
  expect_from(0, double(options.max_iterations), "ransac: max_iterations");
  expect_from(0, double(options.min_inliers), "ransac: min_inliers");
  expect_from(0, double(options.preview), "ransac: preview");
}

double samples_needed(double confidence, double share, index_t sample_size) {
  const double good = std::pow(share, double(sample_size));
  if (confidence >= 1) return std::numeric_limits<double>::infinity();
  if (good >= 1) return 1;
  // log1p keeps what a small probability would lose.
  return std::ceil(std::log1p(-confidence) / std::log1p(-good));
}

bool is_hopeless(double share, double best, index_t count) {
  return share < best - 3 * std::sqrt(best * (1 - best) / double(count));
}

}  // namespace cilantro
