// SPDX-License-Identifier: MIT
export module cilantro.registration:pair_graph;

import cilantro.standard;
import cilantro.core;
import :putative_pairs;

namespace cilantro {

/// Writes the row of a pair: bit j of word j / 64 for each pair j that may be right together with
/// it.
using pair_row_writer = std::function<void(index_t pair, std::span<std::uint64_t> row)>;

template <int D>
std::vector<pair_proposal<D>> propose_by_graph(const putative_pairs<D>& pairs,
                                               const pair_row_writer& write_row, const int& seeds,
                                               const execution& how);
/// The rows of the library's own invariants, many pairs at a time.
template <int D>
pair_row_writer row_writer(const putative_pairs<D>& pairs, const equal_lengths& invariant);
template <int D>
pair_row_writer row_writer(const putative_pairs<D>& pairs,
                           const equal_lengths_and_angles& invariant);
/// Throws `invalid_input` unless there is a seed.
void expect_seeds(int seeds);

/// The most pairs of which a graph is made; of more, as many are drawn at random.
export inline constexpr index_t most_graph_pairs = 20000;

/// Finds transforms in the graph that joins each two pairs which an invariant lets be right
/// together: right pairs are all joined to one another, wrong ones to others by chance.
///
/// The edges of a pair count by how many neighbours both ends share. From the pairs that count
/// most, as `seeds`, cliques are grown that give a transform each; pairs that an earlier one has
/// explained are no seeds again, so that few are needed where all pairs are right. With 99 % wrong
/// pairs of 5,000 it finds the 50 right ones.
///
/// At most `most_graph_pairs` pairs are compared. O(N²) with N²/8 bytes, 3 MB for 5,000 pairs; the
/// number of edges does not matter, since of each pair a limited number is looked at.
/// Source: the second-order measure of Chen et al. 2022, "SC²-PCR", equation 3; seeds and cliques
/// in place of its spectral matching.
export template <class Invariant = equal_lengths_and_angles>
struct pair_graph {
  static_assert(
      PairInvariant<Invariant, 2> || PairInvariant<Invariant, 3>,
      "pair_graph: an invariant is called as invariant(a, b, all), with two putative_pair "
      "and all putative_pairs, and returns whether both may be right");

  Invariant invariant = {};  ///< What two right pairs share.
  int seeds = 100;           ///< How many pairs a transform is grown from at most.

  template <int D>
    requires PairInvariant<Invariant, D>
  [[nodiscard]] std::vector<pair_proposal<D>> propose(const putative_pairs<D>& pairs,
                                                      const execution& how) const {
    expect_seeds(seeds);
    if constexpr (requires { row_writer<D>(pairs, invariant); }) {
      return propose_by_graph<D>(pairs, row_writer<D>(pairs, invariant), seeds, how);
    } else {
      return propose_by_graph<D>(
          pairs,
          [&](index_t i, std::span<std::uint64_t> row) {
            const auto one = pairs[i];
            for (index_t j = 0; j < pairs.size(); ++j)
              if (j != i && invariant(one, pairs[j], pairs))
                row[j / 64] |= std::uint64_t{1} << (j % 64);
          },
          seeds, how);
    }
  }
};
export template <class Invariant>
pair_graph(Invariant) -> pair_graph<Invariant>;

static_assert(PairSolver<pair_graph<>, 2> && PairSolver<pair_graph<equal_lengths>, 3>);

}  // namespace cilantro
