// SPDX-License-Identifier: MIT
module;
#include "core/parallel_backend.hpp"
export module cilantro.core:parallel;

import cilantro.standard;
import :error;
import :execution;
import :points;

namespace cilantro {

/// How many items `parallel_for` and `ordered_sum` hand to a thread at a time. A constant, so that
/// sums are split in the same places on every machine.
export inline constexpr index_t default_block_size = 1024;

/// Calls `f(block, begin, end)` for the consecutive blocks of `block_size` items that make up [0,
/// n), in no particular order, on up to `how.threads` threads. `f` may write only to memory that
/// belongs to its items.
///
/// If `f` throws in several blocks, the exception of the first of these blocks reaches the caller.
/// Throws `cancelled` once a stop was requested, and `invalid_input` for a negative number of
/// threads, a negative n, or a block size below 1.
export template <class F>
void parallel_blocks(index_t n, index_t block_size, const execution& how, F&& f) {
  expect_from(0, how.threads, "threads (0 leaves the choice to OpenMP)");
  expects(n >= 0 && block_size > 0,
          "parallel_blocks: n must not be negative, and the block size must be positive");
  const index_t blocks = n / block_size + (n % block_size != 0);
  struct context {
    index_t n, block_size, blocks;
    const task_monitor& monitor;
    std::remove_reference_t<F>& f;
  } all{n, block_size, blocks, how.monitor, f};

  const bool finished = detail::run_blocks({
      .blocks = blocks,
      .threads = how.threads,
      .context = &all,
      .run =
          [](void* c, std::ptrdiff_t block) {
            const auto& job = *static_cast<context*>(c);
            const index_t begin = block * job.block_size;
            job.f(block, begin, std::min(job.n, begin + job.block_size));
          },
      .stop_requested = !how.monitor.stop.stop_possible()
                            ? nullptr
                            : [](void* c) {
                                return static_cast<context*>(c)->monitor.stop.stop_requested();
                              },
      .report = !how.monitor.progress
                    ? nullptr
                    : [](void* c, std::ptrdiff_t done) {
                        const auto& job = *static_cast<context*>(c);
                        job.monitor.progress(double(done) / double(job.blocks));
                      },
  });
  if (!finished) throw cancelled{};
}

/// Calls `f(i)` for every i in [0, n), as `parallel_blocks` does.
export template <class F>
void parallel_for(index_t n, const execution& how, F&& f) {
  parallel_blocks(n, default_block_size, how, [&](index_t, index_t begin, index_t end) {
    for (index_t i = begin; i < end; ++i) f(i);
  });
}

/// The sum over [0, n) of what `f(sum, i)` adds to a `T` that starts as a copy of `zero`.
///
/// Each block is summed separately, and the blocks are added with `+=` in their order, so the
/// result has the same bits for any number of threads. Allocates one `T` per block of 1024 items.
export template <class T, class F>
[[nodiscard]] T ordered_sum(index_t n, const execution& how, const T& zero, F&& f) {
  std::vector<T> partial(
      static_cast<std::size_t>((n + default_block_size - 1) / default_block_size), zero);
  parallel_blocks(n, default_block_size, how, [&](index_t block, index_t begin, index_t end) {
    T& sum = partial[block];
    for (index_t i = begin; i < end; ++i) f(sum, i);
  });
  T total = zero;
  for (const T& sum : partial) total += sum;
  return total;
}

}  // namespace cilantro
