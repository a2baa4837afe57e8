// SPDX-License-Identifier: MIT
//
// The seam to MPI, which is spoken in mpi_backend.cpp alone. Not a module unit.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <vector>

namespace cilantro::mpi::detail {

/// A call into MPI failed, or ranks called different things.
class failure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A process's part in a job of MPI, from its start to its end: see `communicator`.
class session {
 public:
  session(int& argc, char**& argv, double patience);
  ~session();

  /// Whether this process has one.
  static bool exists();

  [[nodiscard]] int rank() const;
  [[nodiscard]] int size() const;
  std::vector<std::vector<std::byte>> all_gather(std::span<const std::byte> mine);
  void deal(std::ptrdiff_t count);
  std::optional<std::ptrdiff_t> next_ticket();

  class job;

 private:
  std::unique_ptr<job> job_;
};

}  // namespace cilantro::mpi::detail
