// SPDX-License-Identifier: MIT
module cilantro.registration;

import cilantro.eigen;
import :pair_fit;

namespace cilantro {
namespace {

/// Samples between two looks at how many are still needed.
constexpr index_t samples_at_a_time = 512;
constexpr std::size_t most_proposals = 16;

struct scored_sample {
  double score = 0;
  index_t agreeing = 0, number = 0;
};

/// The pairs of a sample; fewer than D if their lengths contradict one another.
template <int D>
index_list draw(const putative_pairs<D>& pairs, std::uint64_t seed, index_t number) {
  random_stream random{seed, static_cast<std::uint64_t>(number)};
  auto drawn = distinct_sample(pairs.size(), D, random);
  for (std::size_t a = 0; a < drawn.size(); ++a)
    for (std::size_t b = a + 1; b < drawn.size(); ++b)
      if (!equal_lengths{}(pairs[drawn[a]], pairs[drawn[b]], pairs)) return {};
  return drawn;
}

template <int D>
std::vector<pair_proposal<D>> propose_by_samples(const sampled_pairs& solver,
                                                 const putative_pairs<D>& pairs,
                                                 const execution& how) {
  expect_from(1, double(solver.max_samples), "sampled_pairs: max_samples");
  expects(solver.confidence > 0 && solver.confidence < 1,
          "sampled_pairs: confidence must be in (0, 1)");
  if (pairs.size() < D) return {};
  std::vector<scored_sample> best;
  double needed = double(solver.max_samples);
  for (index_t begin = 0; double(begin) < needed; begin += samples_at_a_time) {
    const index_t count = std::min(samples_at_a_time, solver.max_samples - begin);
    std::vector<scored_sample> some(static_cast<std::size_t>(count));
    parallel_blocks(count, 16, {.threads = how.threads, .monitor = how.monitor},
                    [&](index_t, index_t first, index_t last) {
                      for (index_t k = first; k < last; ++k) {
                        const auto drawn = draw(pairs, solver.seed, begin + k);
                        const auto proposal = fit_pairs<D>(pairs, drawn);
                        if (!proposal) continue;
                        const auto agree = agreeing_pairs(pairs, *proposal);
                        some[k] = {agree.score, std::ssize(agree.members), begin + k};
                      }
                    });
    std::erase_if(some, [](const scored_sample& s) { return s.agreeing < D; });
    best.insert(best.end(), some.begin(), some.end());
    std::ranges::sort(best, {}, [](const auto& s) { return std::pair{-s.score, s.number}; });
    if (best.size() > most_proposals) best.resize(most_proposals);
    if (best.empty()) continue;
    const double right = std::pow(double(best[0].agreeing) / double(pairs.size()), D);
    if (right >= 1) break;
    needed = std::min(needed, std::log(1 - solver.confidence) / std::log1p(-right));
  }
  std::vector<pair_proposal<D>> proposals;
  for (const auto& sample : best)
    proposals.push_back(*fit_pairs<D>(pairs, draw(pairs, solver.seed, sample.number)));
  return proposals;
}

}  // namespace

std::vector<pair_proposal<2>> sampled_pairs::propose(const putative_pairs<2>& pairs,
                                                     const execution& how) const {
  return propose_by_samples(*this, pairs, how);
}
std::vector<pair_proposal<3>> sampled_pairs::propose(const putative_pairs<3>& pairs,
                                                     const execution& how) const {
  return propose_by_samples(*this, pairs, how);
}

}  // namespace cilantro
