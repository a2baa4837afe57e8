// SPDX-License-Identifier: MIT
module;
#include <atomic>
#include <cstdint>
module cilantro.numeric;

namespace cilantro {

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
