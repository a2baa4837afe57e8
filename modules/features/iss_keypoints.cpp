// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
module cilantro.features;

import cilantro.eigen;

namespace cilantro {
namespace {

/// The smallest variance, if each is at most the share `most_alike` of the next larger one, and it
/// is more than rounding makes of points on a plane; otherwise 0.
template <int D>
double saliency(const Eigen::Matrix<double, D, D>& covariance, double most_alike, double rounding) {
  const auto variances = decompose_symmetric(covariance).values;
  if (!(variances[0] > rounding * rounding + 1e-12 * variances[variances.size() - 1])) return 0;
  for (index_t d = 1; d < variances.size(); ++d)
    if (!(variances[d - 1] <= most_alike * variances[d])) return 0;
  return variances[0];
}

/// Neighbourhoods by neighbourhood: each point that is wanted, with its neighbours.
template <Scalar S, int D, class F>
void for_each_near(const kd_tree<S, D>& tree, points_view<S, D> points, double distance,
                   std::span<const std::uint8_t> wanted, const execution& how, F f) {
  visit_neighborhoods(
      tree, points, radius{distance},
      [&](const neighborhood_block<S>& block) {
        for (index_t i = 0; i < block.size(); ++i) f(block.query(i), block[i].indices());
      },
      {.wanted = wanted, .ascending = false, .threads = how.threads, .monitor = how.monitor});
}

}  // namespace

template <Scalar S, int D>
index_list closed_iss_keypoints(points_view<S, D> points, const iss_options& options) {
  const double suppression = options.suppression.value_or(options.radius * 2 / 3);
  expect_from(0, options.radius, "iss_keypoints: radius");
  expects(options.radius > 0, "iss_keypoints: radius is required, in the units of the points");
  expect_from(0, suppression, "iss_keypoints: suppression");
  expects(options.most_alike > 0 && options.most_alike <= 1,
          "iss_keypoints: most_alike must be in (0, 1]");
  expect_from(0, double(options.min_neighbors), "iss_keypoints: min_neighbors");

  const kd_tree<S, D> tree{points, {.threads = options.threads}};
  const execution how{options.threads, in_passes(options.monitor, 2)};
  std::vector<double> salient(static_cast<std::size_t>(points.size()));
  for_each_near(tree, points, options.radius, {}, how,
                [&](index_t i, std::span<const std::int32_t> near) {
                  if (std::ssize(near) < options.min_neighbors) return;
                  // In one order, so that points with the same neighbours are equally salient.
                  index_list members(near.begin(), near.end());
                  std::ranges::sort(members);
                  const auto found = mean_and_covariance(points, members);
                  if (!found) return;
                  const double rounding = 4 * double(std::numeric_limits<S>::epsilon()) *
                                          double(found->mean.cwiseAbs().maxCoeff());
                  salient[i] = saliency<D>(found->covariance, options.most_alike, rounding);
                });

  std::vector<std::uint8_t> kept(salient.size());
  for (std::size_t i = 0; i < salient.size(); ++i) kept[i] = salient[i] > 0;
  const std::vector<std::uint8_t> candidates = kept;
  for_each_near(tree, points, suppression, candidates, how,
                [&](index_t i, std::span<const std::int32_t> near) {
                  for (const auto j : near)
                    if (salient[j] > salient[i] || (salient[j] == salient[i] && j < i)) kept[i] = 0;
                });
  index_list keypoints;
  for (std::size_t i = 0; i < kept.size(); ++i)
    if (kept[i]) keypoints.push_back(static_cast<std::int32_t>(i));
  return keypoints;
}

#define CILANTRO_INSTANTIATE(S, D) \
  template index_list closed_iss_keypoints(points_view<S, D>, const iss_options&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
