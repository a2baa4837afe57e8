// SPDX-License-Identifier: MIT
export module cilantro.tiles:communicator;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// Several processes, the ranks of a job, that work on one cloud in tiles together.
///
/// Semantics: `rank()` counts from 0. `all_gather` and `deal` are collective: all ranks call them,
/// in the same order. `all_gather(mine)` returns what each rank gives, by rank. `deal(count)` opens
/// a round of tickets 0 to count − 1, of which `next_ticket()` gives each to one rank, to whoever
/// asks next, and nothing when all are taken; several threads of a rank may ask at once. Models:
/// `cilantro::mpi::communicator`.
export template <class C>
concept Communicator = requires(C& c, std::span<const std::byte> mine, index_t count) {
  { c.rank() } -> std::convertible_to<int>;
  { c.size() } -> std::convertible_to<int>;
  { c.all_gather(mine) } -> std::convertible_to<std::vector<std::vector<std::byte>>>;
  c.deal(count);
  { c.next_ticket() } -> std::convertible_to<std::optional<index_t>>;
};

/// A communicator of any type, which must outlive it.
struct process_group {
  int rank = 0, size = 1;
  std::function<std::vector<std::vector<std::byte>>(std::span<const std::byte>)> all_gather;
  std::function<void(index_t)> deal;
  std::function<std::optional<index_t>()> next_ticket;
};

template <Communicator C>
[[nodiscard]] process_group group_of(C& ranks) {
  return {ranks.rank(), ranks.size(),
          [&ranks](std::span<const std::byte> mine) { return ranks.all_gather(mine); },
          [&ranks](index_t count) { ranks.deal(count); },
          [&ranks]() -> std::optional<index_t> { return ranks.next_ticket(); }};
}

}  // namespace cilantro
