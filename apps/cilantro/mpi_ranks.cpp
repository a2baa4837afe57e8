// SPDX-License-Identifier: MIT
//
// Ranks of MPI: mpirun -n 4 cilantro-mpi …
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "ranks.hpp"

import cilantro.mpi;

namespace {

class ranks_of_mpi : public job_of_ranks {
 public:
  ranks_of_mpi(int& argc, char**& argv) : world_{argc, argv} {}

  [[nodiscard]] int rank() const override { return world_.rank(); }
  [[nodiscard]] int size() const override { return world_.size(); }
  [[nodiscard]] std::vector<std::vector<std::byte>> all_gather(
      std::span<const std::byte> mine) override {
    return world_.all_gather(mine);
  }
  void deal(std::ptrdiff_t count) override { world_.deal(count); }
  [[nodiscard]] std::optional<std::ptrdiff_t> next_ticket() override {
    return world_.next_ticket();
  }

 private:
  cilantro::mpi::communicator world_;
};

}  // namespace

std::unique_ptr<job_of_ranks> start_ranks(int& argc, char**& argv) {
  return std::make_unique<ranks_of_mpi>(argc, argv);
}
