// SPDX-License-Identifier: MIT
//
// What the ranks of a job tell each other. Internal.
module cilantro.tiles:ranks;

import cilantro.standard;
import cilantro.core;
import :communicator;

namespace cilantro {

/// What each rank says, by rank; only what this one says if it is alone.
std::vector<std::string> gather_texts(const process_group* ranks, std::string_view mine);

/// What all ranks have, rank after rank.
template <class T>
std::vector<T> gather_all(const process_group* ranks, const std::vector<T>& mine) {
  const auto bytes = std::as_bytes(std::span{mine});
  std::vector<T> all;
  for (const auto& text :
       gather_texts(ranks, {reinterpret_cast<const char*>(bytes.data()), bytes.size()})) {
    const auto first = all.size();
    all.resize(first + text.size() / sizeof(T));
    if (!text.empty()) std::memcpy(all.data() + first, text.data(), text.size());
  }
  return all;
}

/// Calls `f` on all ranks, or on the first alone, and waits for all. If it throws on one, each rank
/// throws: that one the same, others what it was, as a `std::runtime_error`.
void on_all_ranks(const process_group* ranks, const std::function<void()>& f);
void on_first_rank(const process_group* ranks, const std::function<void()>& f);

/// Takes what is left of a round of tickets, so that the other ranks are told that there are no
/// more: they need not go on once one of them has been told to stop.
void take_all_tickets(const process_group* ranks);

}  // namespace cilantro
