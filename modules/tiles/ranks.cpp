// SPDX-License-Identifier: MIT
module cilantro.tiles;

import :communicator;
import :ranks;

namespace cilantro {

std::vector<std::string> gather_texts(const process_group* ranks, std::string_view mine) {
  std::vector<std::string> texts;
  if (ranks == nullptr) return {std::string{mine}};
  for (const auto& bytes : ranks->all_gather(std::as_bytes(std::span{mine})))
    texts.emplace_back(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return texts;
}

void on_all_ranks(const process_group* ranks, const std::function<void()>& f) {
  if (ranks == nullptr) return f();
  std::exception_ptr error;
  std::string what;
  try {
    f();
  } catch (const std::exception& e) {
    error = std::current_exception();
    what = e.what();
    if (what.empty()) what = "an error without a message";
  } catch (...) {
    error = std::current_exception();
    what = "an unknown error";
  }
  const auto all = gather_texts(ranks, what);
  if (error) std::rethrow_exception(error);
  for (std::size_t r = 0; r < all.size(); ++r)
    if (!all[r].empty()) throw std::runtime_error{"rank " + std::to_string(r) + ": " + all[r]};
}

void on_first_rank(const process_group* ranks, const std::function<void()>& f) {
  on_all_ranks(ranks, [&] {
    if (ranks == nullptr || ranks->rank == 0) f();
  });
}

void take_all_tickets(const process_group* ranks) {
  while (ranks != nullptr && ranks->next_ticket()) {
  }
}

}  // namespace cilantro
