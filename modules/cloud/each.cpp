// SPDX-License-Identifier: MIT
module;
#include <condition_variable>
#include <thread>

#include "core/parallel_backend.hpp"
module cilantro.cloud;

namespace cilantro {

struct work_ahead::state {
  struct task {
    bool is_done = false;
    std::exception_ptr error;
  };

  state(int how_many, std::function<bool(index_t)> fetch, std::function<void(index_t)> perform)
      : ahead{how_many},
        take{std::move(fetch)},
        work{std::move(perform)},
        tasks(static_cast<std::size_t>(how_many) + 1) {}

  [[nodiscard]] index_t slot_of(index_t number) const { return number % std::ssize(tasks); }

  // Takes the next task; its number, or nothing if there is none or no more is wanted.
  std::optional<index_t> take_next();
  void run();

  const int ahead;
  const int thread_count = std::min(ahead, int(std::max(1U, std::thread::hardware_concurrency())));
  const int threads_each = detail::threads_of_part(thread_count);
  const std::function<bool(index_t)> take;
  const std::function<void(index_t)> work;

  std::mutex order;  // Of whoever takes.
  std::mutex mutex;  // Of all below.
  std::condition_variable changed;
  std::vector<task> tasks;  // By slot.
  index_t taken = 0, released = 0;
  bool has_ended = false, stop = false;
  std::vector<std::thread> threads;
};

std::optional<index_t> work_ahead::state::take_next() {
  const std::scoped_lock in_order{order};
  index_t number = 0;
  {
    std::unique_lock lock{mutex};
    // The one that is in use does not count.
    changed.wait(lock, [&] { return stop || has_ended || taken <= released + ahead; });
    if (stop || has_ended) return std::nullopt;
    number = taken;
    tasks[slot_of(number)] = {};
  }
  bool is_there = true;
  std::exception_ptr error;
  try {
    is_there = take(slot_of(number));
  } catch (...) {
    error = std::current_exception();
  }
  const std::scoped_lock lock{mutex};
  has_ended = has_ended || !is_there || error;
  if (is_there) ++taken;
  if (error) tasks[slot_of(number)] = {true, error};
  changed.notify_all();
  return is_there && !error ? std::optional{number} : std::nullopt;
}

void work_ahead::state::run() {
  detail::use_threads(threads_each);
  while (const auto number = take_next()) {
    std::exception_ptr error;
    try {
      work(slot_of(*number));
    } catch (...) {
      error = std::current_exception();
    }
    const std::scoped_lock lock{mutex};
    tasks[slot_of(*number)] = {true, error};
    changed.notify_all();
  }
}

work_ahead::work_ahead(int ahead, std::function<bool(index_t)> take,
                       std::function<void(index_t)> work)
    : state_{std::make_unique<state>(ahead, std::move(take), std::move(work))} {
  state_->threads.reserve(state_->thread_count);
  while (std::ssize(state_->threads) < state_->thread_count) {
    try {
      state_->threads.emplace_back([all = state_.get()] { all->run(); });
    } catch (const std::system_error&) {
      if (state_->threads.empty()) throw;
      break;  // Fewer threads give the same results.
    }
  }
}

work_ahead::~work_ahead() {
  {
    const std::scoped_lock lock{state_->mutex};
    state_->stop = true;
    state_->changed.notify_all();
  }
  for (auto& thread : state_->threads) thread.join();
}

bool work_ahead::at_end() {
  std::unique_lock lock{state_->mutex};
  state_->changed.wait(lock, [&] { return state_->has_ended || state_->taken > state_->released; });
  return state_->taken <= state_->released;
}

index_t work_ahead::wait() {
  std::unique_lock lock{state_->mutex};
  const index_t slot = state_->slot_of(state_->released);
  const auto& first = state_->tasks[slot];
  state_->changed.wait(lock, [&] { return state_->taken > state_->released && first.is_done; });
  if (first.error) std::rethrow_exception(first.error);
  return slot;
}

void work_ahead::release() {
  const std::scoped_lock lock{state_->mutex};
  ++state_->released;
  state_->changed.notify_all();
}

}  // namespace cilantro
