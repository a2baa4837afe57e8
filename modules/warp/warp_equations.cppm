// SPDX-License-Identifier: MIT
//
// Normal equations of the motions of many nodes, whatever moves them and whatever is minimised.
// Internal.
export module cilantro.warp:warp_equations;

import cilantro.standard;
import cilantro.core;
import cilantro.numeric;
import cilantro.search;
import cilantro.registration;

namespace cilantro {

/// Lists of nodes, ascending, one after the other.
struct node_lists {
  std::vector<std::int32_t> nodes;
  std::vector<index_t> offsets{0};  ///< Where each list begins, and where the last one ends.

  [[nodiscard]] index_t size() const { return std::ssize(offsets) - 1; }
  [[nodiscard]] std::span<const std::int32_t> operator[](index_t i) const {
    return std::span{nodes}.subspan(static_cast<std::size_t>(offsets[i]),
                                    static_cast<std::size_t>(offsets[i + 1] - offsets[i]));
  }
  void add(std::span<const std::int32_t> list) {
    nodes.insert(nodes.end(), list.begin(), list.end());
    offsets.push_back(std::ssize(nodes));
  }
};

/// The rows of the residuals of one list of nodes: their values, and their derivatives by the
/// unknowns of the first node, the second, and so on. Both are scaled by the root of their weight.
class row_buffer {
 public:
  /// For rows of that many unknowns.
  void reset(index_t unknowns);
  /// A row to be filled in, all of its unknowns; valid until the next call.
  [[nodiscard]] double* add(double value);

  [[nodiscard]] index_t count() const { return count_; }
  [[nodiscard]] index_t width() const { return width_; }
  [[nodiscard]] const double* rows() const { return rows_.data(); }
  [[nodiscard]] const double* values() const { return values_.data(); }

  detail::pair_totals totals;  ///< Of the pairs that the rows are of.

 private:
  index_t unknowns_ = 0, width_ = 0, count_ = 0;
  std::vector<double> rows_, values_;  ///< They only grow.
};

/// What the rows of all lists add up to.
struct warp_sums {
  std::vector<double> blocks;  ///< In the order of the solver's pattern.
  std::vector<double> gradient;
  double energy = 0;  ///< The sum of the squared values.
  detail::pair_totals totals;
  std::vector<char> has_rows;  ///< For each list.
};

/// What is kept from one sum to the next, so that memory is allocated once.
struct equation_memory {
  warp_sums sums;
  buffer<double> blocks, gradient;  ///< Sums of groups of lists.
  std::vector<double> damped, step;
  block_factor factor;
};

/// Sums rows into blocks, and solves for the unknowns. Immutable, and may be shared by threads.
class warp_equations {
 public:
  warp_equations(index_t nodes, index_t unknowns_per_node, node_lists lists);

  [[nodiscard]] const node_lists& lists() const { return lists_; }
  [[nodiscard]] index_t nodes() const { return solver_.pattern().nodes(); }
  [[nodiscard]] index_t unknowns_per_node() const { return solver_.block_size(); }

  /// `write(list, rows)` adds the rows of a list, and is called once for each, from several threads
  /// at once. The same bits for any number of threads. Returns what is in `memory`.
  const warp_sums& sum(const std::function<void(index_t list, row_buffer& rows)>& write,
                       const execution& how, equation_memory& memory) const;

  /// The unknowns of a Gauss–Newton step for the sums in `memory`, each damped by `damping` times
  /// its own entry on the diagonal. Those that nothing determines are 0.
  const std::vector<double>& solve(double damping, equation_memory& memory) const;

 private:
  node_lists lists_;
  block_cholesky solver_;
  /// Sums are taken over groups of lists, each into places of its own, and then added.
  struct scattered {
    std::vector<index_t> offsets;        ///< Where the places of each group begin.
    std::vector<std::int32_t> place_of;  ///< For each pair of nodes of a list, or each node.
    std::vector<index_t> sources;        ///< Where, for each sum, its places begin in `places`.
    std::vector<std::int32_t> places;
  };
  static scattered scatter(const std::vector<std::int32_t>& targets,
                           const std::vector<index_t>& group_offsets, index_t count);
  scattered blocks_, gradient_;
  std::vector<index_t> pair_offsets_;  ///< Where the pairs of nodes of each list begin.
};

}  // namespace cilantro
