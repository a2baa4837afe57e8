// SPDX-License-Identifier: MIT
export module cilantro.registration:graduated_pairs;

import cilantro.standard;
import cilantro.core;
import :putative_pairs;

namespace cilantro {

/// Finds one transform by graduated non-convexity (fast global registration): least squares with
/// Geman & McClure's weights, whose scale shrinks from the extent of the points to `max_distance`,
/// so that wrong pairs lose their influence one after the other. Before that, samples of three
/// pairs are taken, and only pairs of those kept whose lengths agree.
///
/// It needs no samples of right pairs only, but a start at which right pairs outweigh wrong ones:
/// up to about half of the pairs may be wrong. O(N) per iteration, of which there are about 60.
/// Source: Zhou, Park & Koltun 2016, "Fast global registration", sections 3.1 and 3.3; for given
/// weights the transform is computed in closed form.
export struct graduated_pairs {
  double narrowing = 1.4;  ///< The scale shrinks by this factor every iteration; above 1.
  index_t tuples = 1000;   ///< How many consistent samples are kept; 0: all pairs, without a test.
  double alike = 0.9;      ///< Lengths of a sample differ by at most this factor, in (0, 1].
  std::uint64_t seed = 0;  ///< Of the samples.

  [[nodiscard]] std::vector<pair_proposal<2>> propose(const putative_pairs<2>& pairs,
                                                      const execution& how) const;
  [[nodiscard]] std::vector<pair_proposal<3>> propose(const putative_pairs<3>& pairs,
                                                      const execution& how) const;
};

static_assert(PairSolver<graduated_pairs, 2> && PairSolver<graduated_pairs, 3>);

}  // namespace cilantro
