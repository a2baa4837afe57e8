// SPDX-License-Identifier: MIT
export module cilantro.mpi:communicator;

import cilantro.standard;
import cilantro.core;

namespace cilantro::mpi {

/// MPI refused a call, or the ranks of a job did not call the same. The sentence says which rank
/// says so, and what it called.
export class communication_error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Options of `communicator`.
export struct communicator_options {
  /// A rank that is not heard of for so many seconds is taken for lost, with its machine or the
  /// network between, and ends the job. Ranks that compute are heard of, those that are suspended
  /// are not. 0 waits forever.
  double patience = 60;
};

/// The processes that `mpirun` started from one program, each with a number, its rank. Without
/// `mpirun`, there is one.
///
/// Make one at the beginning of `main`, in each rank. Its destructor waits for the other ranks. If
/// an exception passes it on one rank, or none catches it, or that rank ends or crashes or loses
/// its network, the whole job ends, with a status that is not 0 and a sentence that names the rank:
/// no other waits for it forever.
///
/// Needs MPI 3 with `MPI_THREAD_SERIALIZED`: each call into MPI is a short one under a lock, and
/// whoever waits sleeps in between. So no rank that waits takes time from one that computes, and
/// those that compute need not call MPI: a thread of each rank, which sleeps for a millisecond at a
/// time, answers for it.
export class communicator {
 public:
  /// Starts MPI, which takes its own arguments out of those of `main`; or uses it where the program
  /// has started it, and does not end it then. Throws `invalid_input` for a second one in a process
  /// and for a patience that is negative or NaN, and `communication_error` if MPI cannot do what is
  /// needed.
  communicator(int& argc, char**& argv, const communicator_options& options = {});
  ~communicator();
  communicator(const communicator&) = delete;
  communicator& operator=(const communicator&) = delete;

  /// The number of this process, from 0.
  [[nodiscard]] int rank() const;
  /// How many there are.
  [[nodiscard]] int size() const;

  /// What each rank gives, by rank: all ranks must call it, each with bytes of its own, of which
  /// there may be any number. Beside the result it needs 64 MiB at most. Throws
  /// `communication_error` where another rank calls something else.
  [[nodiscard]] std::vector<std::vector<std::byte>> all_gather(std::span<const std::byte> mine);

  /// Opens a new round of the tickets 0 to `count` - 1 for `next_ticket`, and ends the one before:
  /// all ranks must call it, with the same count. Throws `invalid_input` for a negative count, and
  /// `communication_error` where ranks differ.
  void deal(index_t count);

  /// The next ticket of the round that no rank has, or nothing when all are taken: each goes to one
  /// rank, in ascending order of asking. Several threads of a rank may ask at once. Rank 0 deals,
  /// also while it computes; another rank waits about a millisecond for its ticket.
  [[nodiscard]] std::optional<index_t> next_ticket();

 private:
  struct state;
  std::unique_ptr<state> state_;
};

}  // namespace cilantro::mpi
