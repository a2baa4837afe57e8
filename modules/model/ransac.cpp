// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
module cilantro.model;

namespace cilantro {

template <Scalar S>
data_score score_of(std::span<const S> residuals, std::span<const std::uint8_t> active,
                    double max_residual, ransac_score by) {
  // Sums in lanes, in an order that does not depend on the machine and that vectors can follow.
  constexpr std::size_t lanes = 8;
  std::array<S, lanes> sum{};
  std::array<std::int32_t, lanes> count{};
  // The largest S that is not above the limit, so that comparing in S is comparing in double.
  S limit = static_cast<S>(max_residual);
  if (double(limit) > max_residual) limit = std::nextafter(limit, S(0));
  const S scale = static_cast<S>(1 / (max_residual * max_residual));
  const auto add = [&](std::size_t lane, S r, bool counts) {
    const bool agrees = counts && r <= limit;
    count[lane] += agrees;
    sum[lane] += agrees ? 1 - r * r * scale : S(0);
  };
  std::size_t k = 0;
  if (active.empty())
    for (; k + lanes <= residuals.size(); k += lanes)
      for (std::size_t lane = 0; lane < lanes; ++lane) add(lane, residuals[k + lane], true);
  for (; k < residuals.size(); ++k) add(k % lanes, residuals[k], active.empty() || active[k] != 0);
  data_score all;
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    all.inliers += count[lane];
    all.value += double(sum[lane]);
  }
  if (by == ransac_score::inliers) all.value = double(all.inliers);
  return all;
}
template data_score score_of(std::span<const float>, std::span<const std::uint8_t>, double,
                             ransac_score);
template data_score score_of(std::span<const double>, std::span<const std::uint8_t>, double,
                             ransac_score);

void expect_sensible(const ransac_options& options) {
  expects(options.confidence > 0 && options.confidence <= 1,
          "ransac: the confidence must be above 0, and at most 1");
  expects(options.max_iterations >= 0 && options.min_inliers >= 0 && options.preview >= 0,
          "ransac: limits and counts must not be negative");
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
