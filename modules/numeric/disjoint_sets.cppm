// SPDX-License-Identifier: MIT
export module cilantro.numeric:disjoint_sets;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// Disjoint sets of the numbers 0 to N − 1 that can be joined but not split, by several threads at
/// once and without locks. The representative of a set is its smallest number, whatever the order
/// of the joins. Nearly O(1) per operation.
/// Source: Anderson & Woll 1991, "Wait-free parallel algorithms for the union-find problem", with
/// roots ordered by number.
export class disjoint_sets {
 public:
  /// Each number in a set of its own. Throws `invalid_input` for a negative size or above 2³¹ − 1.
  explicit disjoint_sets(index_t size);

  [[nodiscard]] index_t size() const { return std::ssize(parents_); }

  /// The representative of the set of i. While other threads join sets, it may be an earlier
  /// representative. Precondition: 0 <= i < size().
  [[nodiscard]] index_t find(index_t i) {
    // Nearly always the root is the node itself, or one step away.
    const auto at = static_cast<std::int32_t>(i), parent = load(at);
    return load(parent) == parent ? parent : climb(at);
  }

  /// Joins the sets of i and j; returns false if they were the same set already. Precondition: 0 <=
  /// i, j < size().
  bool join(index_t i, index_t j) {
    for (;;) {
      auto a = static_cast<std::int32_t>(find(i)), b = static_cast<std::int32_t>(find(j));
      if (a == b) return false;
      if (a < b) std::swap(a, b);
      // Fails if another thread has meanwhile put the root a below another one.
      std::int32_t expected = a;
      if (link(a).compare_exchange_strong(expected, b, std::memory_order_relaxed)) return true;
    }
  }

 private:
  std::atomic_ref<std::int32_t> link(std::int32_t i) { return std::atomic_ref{parents_[i]}; }
  std::int32_t load(std::int32_t i) { return link(i).load(std::memory_order_relaxed); }

  std::int32_t climb(std::int32_t at);

  std::vector<std::int32_t> parents_;
};

}  // namespace cilantro
