// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

/// The ranks of the job that this process belongs to, as `cilantro::Communicator` wants them;
/// plain, so that what is built without MPI needs nothing of it.
class job_of_ranks {
 public:
  job_of_ranks() = default;
  job_of_ranks(const job_of_ranks&) = delete;
  job_of_ranks& operator=(const job_of_ranks&) = delete;
  virtual ~job_of_ranks() = default;

  [[nodiscard]] virtual int rank() const = 0;
  [[nodiscard]] virtual int size() const = 0;
  [[nodiscard]] virtual std::vector<std::vector<std::byte>> all_gather(
      std::span<const std::byte> mine) = 0;
  virtual void deal(std::ptrdiff_t count) = 0;
  [[nodiscard]] virtual std::optional<std::ptrdiff_t> next_ticket() = 0;
};

/// Starts what this program was built with; nothing if it has no ranks.
std::unique_ptr<job_of_ranks> start_ranks(int& argc, char**& argv);
