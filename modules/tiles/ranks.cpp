// SPDX-License-Identifier: MIT
module;
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>
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

distance_statistics add_up(const process_group* ranks, const distance_statistics& mine) {
  if (ranks == nullptr) return mine;
  // Sums are exact: in whatever order they are added, all ranks have the same.
  auto own = mine;
  std::string bytes;
  const auto put = [&](const void* data, std::size_t size) {
    bytes.append(static_cast<const char*>(data), size);
  };
  for (auto* sum : {&own.sum, &own.squares}) {
    const auto limbs = sum->limbs();
    put(limbs.data(), limbs.size_bytes());
  }
  put(&own.count, sizeof own.count);
  distance_statistics all;
  for (const auto& text : gather_texts(ranks, bytes)) {
    distance_statistics one;
    const char* from = text.data();
    const auto take = [&](void* data, std::size_t size) {
      std::memcpy(data, from, size);
      from += size;
    };
    if (text.size() != bytes.size()) throw std::runtime_error{"ranks run different programs"};
    for (auto* sum : {&one.sum, &one.squares}) {
      const auto limbs = sum->limbs();
      take(limbs.data(), limbs.size_bytes());
    }
    take(&one.count, sizeof one.count);
    all += one;
  }
  return all;
}

}  // namespace cilantro
