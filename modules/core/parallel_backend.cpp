// SPDX-License-Identifier: MIT
#include "parallel_backend.hpp"

#include <omp.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>

namespace cilantro::detail {
namespace {

/// More would only wait for each other, and creating them can fail.
constexpr std::ptrdiff_t most_threads = 1024;

class job_state {
 public:
  explicit job_state(const block_job& job) : job_{job}, error_block_{job.blocks} {}

  void run(std::ptrdiff_t block) {
    // Blocks below a failed one still run: theirs would be the exception to report.
    if (stopped_.load(std::memory_order_relaxed) || block > error_block_.load()) return;
    try {
      if (job_.stop_requested && job_.stop_requested(job_.context)) {
        stopped_ = true;
        return;
      }
      job_.run(job_.context, block);
      const std::ptrdiff_t done = 1 + done_.fetch_add(1);
      if (job_.report && std::this_thread::get_id() == caller_) report(done);
    } catch (...) {
      const std::lock_guard lock{mutex_};
      if (block < error_block_) {
        error_ = std::current_exception();
        error_block_ = block;
      }
    }
  }

  bool finish() {
    if (error_) std::rethrow_exception(error_);
    if (stopped_) return false;
    if (job_.report && reported_ < job_.blocks) report(job_.blocks);
    return true;
  }

 private:
  void report(std::ptrdiff_t done) {
    reported_ = done;
    job_.report(job_.context, done);
  }

  const block_job& job_;
  const std::thread::id caller_ = std::this_thread::get_id();
  std::ptrdiff_t reported_ = 0;
  std::atomic<std::ptrdiff_t> done_ = 0, error_block_;
  std::atomic<bool> stopped_ = false;
  std::mutex mutex_;
  std::exception_ptr error_;
};

}  // namespace

bool run_blocks(const block_job& job) {
  const std::ptrdiff_t wanted = job.threads > 0 ? job.threads : omp_get_max_threads();
  const int threads = static_cast<int>(std::min({wanted, job.blocks, most_threads}));
  job_state state{job};
  if (threads <= 1) {
    for (std::ptrdiff_t block = 0; block < job.blocks; ++block) state.run(block);
  } else {
#pragma omp parallel for schedule(dynamic) num_threads(threads)
    for (std::ptrdiff_t block = 0; block < job.blocks; ++block) state.run(block);
  }
  return state.finish();
}

int threads_of_part(int parts) {
  return std::max(1, omp_get_max_threads() / parts);
}
void use_threads(int count) {
  omp_set_num_threads(count);
}

}  // namespace cilantro::detail
