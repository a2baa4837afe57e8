// SPDX-License-Identifier: MIT
module cilantro.numeric;

namespace cilantro {

disjoint_sets::disjoint_sets(index_t size) {
  expects(0 <= size && size <= std::numeric_limits<std::int32_t>::max(),
          "disjoint_sets: there can be at most 2^31 - 1 numbers");
  parents_.resize(size);
  std::iota(parents_.begin(), parents_.end(), 0);
}

std::int32_t disjoint_sets::climb(std::int32_t at) {
  for (std::int32_t parent = load(at); parent != at; parent = load(at)) {
    const std::int32_t next = load(parent);
    if (next == parent) return parent;
    // Halves the path. Whatever others write here is an ancestor, too.
    link(at).store(next, std::memory_order_relaxed);
    at = next;
  }
  return at;
}

}  // namespace cilantro
