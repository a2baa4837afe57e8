// SPDX-License-Identifier: MIT
export module cilantro.registration:sampled_pairs;

import cilantro.standard;
import cilantro.core;
import :putative_pairs;

namespace cilantro {

/// Finds transforms by random samples of as many pairs as determine one (RANSAC). A sample whose
/// lengths differ between source and target is dropped before anything is computed; the transforms
/// that most pairs agree with are proposed.
///
/// It stops once a better transform would have been found with probability `confidence`, at the
/// latest after `max_samples`. With a share w of right pairs that takes about 7 / w³ samples in 3D:
/// quick for many right pairs, out of reach for 1 %, for which `pair_graph` is made.
/// Source: Fischler & Bolles 1981; the test of lengths is that of Buch et al. 2013, "Pose
/// estimation using local structure-specific shape and appearance context", section IV.
export struct sampled_pairs {
  index_t max_samples = 100000;
  double confidence = 0.999;  ///< In (0, 1).
  std::uint64_t seed = 0;     ///< The same seed gives the same samples.

  [[nodiscard]] std::vector<pair_proposal<2>> propose(const putative_pairs<2>& pairs,
                                                      const execution& how) const;
  [[nodiscard]] std::vector<pair_proposal<3>> propose(const putative_pairs<3>& pairs,
                                                      const execution& how) const;
};

static_assert(PairSolver<sampled_pairs, 2> && PairSolver<sampled_pairs, 3>);

}  // namespace cilantro
