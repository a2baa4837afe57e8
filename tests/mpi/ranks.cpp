// SPDX-License-Identifier: MIT
//
// What one rank does; started several times by on_ranks.sh. See CMakeLists.txt for what there is.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>

import cilantro;
import cilantro.mpi;
import rank_support;

using namespace cilantro;

namespace {

/// All that ranks can do, with the hash that threads have.
void check(mpi::communicator& ranks) {
  // Above what is gathered at once.
  const std::size_t most = (std::size_t{200} << 20) / std::size_t(ranks.size());
  const auto hash = test::check_ranks(ranks, most);
  std::uint64_t expected = 0;
  if (ranks.rank() == 0)
    test::in_process_ranks{ranks.size()}.run([&](auto& rank) {
      const auto of_threads = test::check_ranks(rank, most);
      if (rank.rank() == 0) expected = of_threads;
    });
  test::require(ranks.rank() != 0 || hash == expected, "processes and threads have the same");
  if (ranks.rank() == 0) std::cout << "the same for " << ranks.size() << " ranks\n";
}

/// What rank 1 does while the others wait for it.
void misbehave(const std::string& how, mpi::communicator& ranks) {
  if (how == "throws" || how == "throws_to_nobody") throw std::runtime_error{"no such tile"};
  if (how == "exits") std::exit(0);
  if (how == "aborts") std::abort();
  if (how == "is_killed") std::raise(SIGKILL);
  if (how == "stands_still") {
    std::raise(SIGSTOP);
    return;
  }
  if (how == "deals_otherwise") ranks.deal(2);
  if (how == "leaves_early") return;
  throw std::invalid_argument{how};
}

/// Ten seconds of work for four ranks, of which the first says what each has done.
void work(mpi::communicator& ranks) {
  ranks.deal(400);
  int done = 0;
  for (; ranks.next_ticket(); ++done) std::this_thread::sleep_for(std::chrono::milliseconds{100});
  for (const auto& theirs : ranks.all_gather(std::as_bytes(std::span{&done, 1}))) {
    std::ranges::copy(theirs, std::as_writable_bytes(std::span{&done, 1}).begin());
    if (ranks.rank() == 0) std::cout << done << " tickets\n";
  }
}

void run(const std::string& how, int& argc, char**& argv) {
  double patience = how == "stands_still" ? 2 : 60;
  if (argc > 2) patience = std::stod(argv[2]);
  mpi::communicator ranks{argc, argv, {.patience = patience}};
  if (how == "works") return work(ranks);
  if (how == "check") return check(ranks);
  if (how == "second") {
    try {
      mpi::communicator second{argc, argv};
    } catch (const invalid_input& what) {
      if (ranks.rank() == 0) std::cout << what.what() << '\n';
    }
    return;
  }
  if (ranks.rank() == 1) return misbehave(how, ranks);
  if (how == "deals_otherwise") return ranks.deal(1);
  ranks.deal(10);
  while (ranks.next_ticket()) continue;
  (void)ranks.all_gather({});
}

}  // namespace

int main(int argc, char** argv) {
  const std::string how = argc > 1 ? argv[1] : "";
  if (how == "throws_to_nobody") run(how, argc, argv);
  try {
    run(how, argc, argv);
  } catch (const std::exception& what) {
    std::cerr << "main: " << what.what() << '\n';
    return 1;
  }
}
