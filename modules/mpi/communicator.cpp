// SPDX-License-Identifier: MIT
module;
#include "mpi_backend.hpp"
module cilantro.mpi;

import cilantro.core;

namespace cilantro::mpi {
namespace {

template <class F>
auto translated(F&& f) {
  try {
    return std::forward<F>(f)();
  } catch (const detail::failure& what) {
    throw communication_error{what.what()};
  }
}

}  // namespace

struct communicator::state {
  detail::session session;
};

communicator::communicator(int& argc, char**& argv, const communicator_options& options) {
  expect_from(0, options.patience, "communicator: patience");
  expects(!detail::session::exists(),
          "communicator: there is one in this process, and MPI allows no second");
  state_ = translated([&] {
    return std::unique_ptr<state>{new state{detail::session{argc, argv, options.patience}}};
  });
}

communicator::~communicator() = default;

int communicator::rank() const {
  return state_->session.rank();
}
int communicator::size() const {
  return state_->session.size();
}

std::vector<std::vector<std::byte>> communicator::all_gather(std::span<const std::byte> mine) {
  return translated([&] { return state_->session.all_gather(mine); });
}

void communicator::deal(index_t count) {
  expects(count >= 0, "communicator::deal: the count must not be negative");
  translated([&] { state_->session.deal(count); });
}

std::optional<index_t> communicator::next_ticket() {
  return translated([&] { return state_->session.next_ticket(); });
}

}  // namespace cilantro::mpi
