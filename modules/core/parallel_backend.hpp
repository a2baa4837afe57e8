// SPDX-License-Identifier: MIT
//
// The seam to OpenMP. Not a module unit: Clang refuses to mix modules compiled with and without
// -fopenmp, so the flag stays with parallel_backend.cpp and off every importer.
#pragma once

#include <cstddef>

namespace cilantro::detail {

/// What to run: block numbers 0 to `blocks` - 1, each once, in any order.
struct block_job {
  std::ptrdiff_t blocks;
  int threads;    ///< 0: OpenMP's own choice.
  void* context;  ///< Handed to the functions below.
  void (*run)(void*, std::ptrdiff_t block);
  bool (*stop_requested)(void*);               ///< Or null; asked before each block.
  void (*report)(void*, std::ptrdiff_t done);  ///< Or null; called on the calling thread.
};

/// False when the job was stopped early. Rethrows the exception of the lowest block that threw.
bool run_blocks(const block_job& job);

/// How many threads each of so many equal parts of those has that OpenMP would use here; at least
/// one.
int threads_of_part(int parts);
/// Sets how many threads OpenMP uses where the calling thread leaves the choice to it.
void use_threads(int count);

}  // namespace cilantro::detail
