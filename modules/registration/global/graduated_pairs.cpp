// SPDX-License-Identifier: MIT
module cilantro.registration;

import cilantro.eigen;
import :pair_fit;

namespace cilantro {
namespace {

/// The pairs of samples of three that are alike in source and target, as often as they are drawn.
template <int D>
index_list consistent_members(const graduated_pairs& solver, const putative_pairs<D>& pairs,
                              const std::stop_token& stop) {
  index_list members;
  if (pairs.size() < 3) return members;
  const auto are_alike = [&](std::int32_t a, std::int32_t b) {
    const double in_source = (pairs.source.col(a) - pairs.source.col(b)).norm();
    const double in_target = (pairs.target.col(a) - pairs.target.col(b)).norm();
    return std::min(in_source, in_target) >= solver.alike * std::max(in_source, in_target) &&
           in_source > 0;
  };
  const index_t most_tries = 100 * pairs.size();
  for (index_t k = 0; k < most_tries && std::ssize(members) < 3 * solver.tuples; ++k) {
    if (k % 1024 == 0 && stop.stop_requested()) throw cancelled{};
    const auto drawn =
        distinct_sample(pairs.size(), 3, random_stream{solver.seed, static_cast<std::uint64_t>(k)});
    if (are_alike(drawn[0], drawn[1]) && are_alike(drawn[1], drawn[2]) &&
        are_alike(drawn[2], drawn[0]))
      members.insert(members.end(), drawn.begin(), drawn.end());
  }
  return members;
}

template <int D>
std::vector<pair_proposal<D>> propose_graduated(const graduated_pairs& solver,
                                                const putative_pairs<D>& pairs,
                                                const execution& how) {
  expects(solver.narrowing > 1 && std::isfinite(solver.narrowing),
          "graduated_pairs: narrowing must be above 1 and finite");
  expect_from(0, double(solver.tuples), "graduated_pairs: tuples");
  expects(solver.alike > 0 && solver.alike <= 1, "graduated_pairs: alike must be in (0, 1]");
  index_list members(static_cast<std::size_t>(pairs.size()));
  std::iota(members.begin(), members.end(), 0);
  if (solver.tuples > 0) members = consistent_members(solver, pairs, how.monitor.stop);
  std::vector<double> weights(members.size(), 1);
  auto found = fit_pairs<D>(pairs, members, weights);
  if (!found) return {};
  const double extent = (pairs.target.colwise() - pairs.target.rowwise().mean()).norm() /
                        std::sqrt(double(pairs.size()));
  const double least = pairs.max_distance * pairs.max_distance;
  double scale = std::max(4 * extent * extent, least);
  while (scale >= least) {
    if (how.monitor.stop.stop_requested()) throw cancelled{};
    for (std::size_t k = 0; k < members.size(); ++k) {
      const double square = (found->rotation * pairs.source.col(members[k]) + found->translation -
                             pairs.target.col(members[k]))
                                .squaredNorm();
      const double weight = scale / (scale + square);
      weights[k] = weight * weight;
    }
    const auto next = fit_pairs<D>(pairs, members, weights);
    if (!next) break;
    found = next;
    scale /= solver.narrowing;
  }
  return {*found};
}

}  // namespace

std::vector<pair_proposal<2>> graduated_pairs::propose(const putative_pairs<2>& pairs,
                                                       const execution& how) const {
  return propose_graduated(*this, pairs, how);
}
std::vector<pair_proposal<3>> graduated_pairs::propose(const putative_pairs<3>& pairs,
                                                       const execution& how) const {
  return propose_graduated(*this, pairs, how);
}

}  // namespace cilantro
