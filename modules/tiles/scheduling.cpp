// SPDX-License-Identifier: MIT
module;
#include <condition_variable>
#include <thread>

#include "core/parallel_backend.hpp"
module cilantro.tiles;

import :communicator;
import :ranks;
import :running;
import :survey;

namespace cilantro {
namespace {

/// Threads that take the next tile, and begin as soon as there is memory for it.
class crew {
 public:
  crew(std::span<const std::uint64_t> costs, std::uint64_t memory,
       const std::function<std::optional<index_t>()>& next,
       const std::function<void(index_t)>& work, const task_monitor& monitor)
      : costs_{costs}, memory_{memory}, next_{next}, work_{work}, monitor_{monitor} {}

  /// `share(i)` is how much of the progress tile `i` of the order is.
  void run(int threads, const std::function<double(index_t)>& share) {
    threads == 1 ? run_here(share) : run_apart(threads, share);
    if (error_) std::rethrow_exception(error_);
    if (is_stopped()) throw cancelled{};
    if (monitor_.progress) monitor_.progress(1);
  }

 private:
  /// Shares are rounded. The end is told once, as it begins another pass of `in_passes`.
  static constexpr double all = 1 - 1e-9;

  void run_here(const std::function<double(index_t)>& share) {
    while (take_one(share))
      if (monitor_.progress && !error_ && share_ < all) monitor_.progress(share_);
  }
  void run_apart(int threads, const std::function<double(index_t)>& share) {
    const int each = detail::threads_of_part(threads);
    std::vector<std::thread> others;
    others.reserve(static_cast<std::size_t>(threads));
    for (int t = 0; t < threads; ++t) {
      const std::scoped_lock lock{mutex_};
      try {
        others.emplace_back([this, each, &share] {
          detail::use_threads(each);
          while (take_one(share)) {
          }
          const std::scoped_lock end{mutex_};
          --at_work_;
          changed_.notify_all();
        });
        ++at_work_;
      } catch (...) {
        if (others.empty()) throw;
        break;  // Fewer threads give the same results.
      }
    }
    watch();
    for (auto& thread : others) thread.join();
  }

  bool take_one(const std::function<double(index_t)>& share) {
    std::exception_ptr error;
    std::uint64_t cost = 0;
    double done = 0;
    try {
      if (has_failed()) return false;
      if (is_stopped()) {
        leave_none();
        return false;
      }
      const auto i = next_();
      if (!i) return false;
      {
        std::unique_lock lock{mutex_};
        changed_.wait(lock, [&] { return in_use_ == 0 || in_use_ + costs_[*i] <= memory_; });
        cost = costs_[*i];
        in_use_ += cost;
      }
      if (!is_over()) {
        work_(*i);
        done = share(*i);
      }
    } catch (const cancelled&) {
      error = std::current_exception();
      leave_none();
    } catch (...) {
      error = std::current_exception();
    }
    const std::scoped_lock lock{mutex_};
    in_use_ -= cost;
    share_ += done;
    if (error && !error_) error_ = error;
    changed_.notify_all();
    return true;
  }

  /// Whoever else asks for tiles is told that there are no more.
  void leave_none() {
    try {
      while (next_()) {
      }
    } catch (...) {
      const std::scoped_lock lock{mutex_};
      if (!error_) error_ = std::current_exception();
    }
  }
  [[nodiscard]] bool is_stopped() const { return monitor_.stop.stop_requested(); }
  [[nodiscard]] bool has_failed() {
    const std::scoped_lock lock{mutex_};
    return bool(error_);
  }
  [[nodiscard]] bool is_over() { return has_failed() || is_stopped(); }

  /// On the thread of the caller, which is the one that progress is reported on.
  void watch() {
    std::unique_lock lock{mutex_};
    for (double reported = 0; at_work_ > 0;) {
      changed_.wait(lock);
      if (!monitor_.progress || share_ <= reported || share_ >= all) continue;
      reported = share_;
      lock.unlock();
      std::exception_ptr error;
      try {
        monitor_.progress(reported);
      } catch (...) {
        error = std::current_exception();
      }
      lock.lock();
      if (error && !error_) error_ = error;
    }
  }

  std::span<const std::uint64_t> costs_;
  std::uint64_t memory_;
  const std::function<std::optional<index_t>()>& next_;
  const std::function<void(index_t)>& work_;
  const task_monitor& monitor_;

  std::mutex mutex_;  // Of all below.
  std::condition_variable changed_;
  int at_work_ = 0;
  std::uint64_t in_use_ = 0;
  double share_ = 0;
  std::exception_ptr error_;
};

}  // namespace

template <int D>
void run_all(const tile_survey<D>& survey, const process_group* ranks,
             std::span<const index_t> tiles, int threads,
             const std::function<std::uint64_t(index_t)>& cost,
             const std::function<void(index_t)>& work, const task_monitor& monitor) {
  std::vector<index_t> order(tiles.begin(), tiles.end());
  std::ranges::sort(order, std::ranges::greater{},
                    [&](index_t t) { return std::pair{survey.tiles[t].points, -t}; });
  std::vector<std::uint64_t> costs;
  double points = 0;
  // Where ranks deal, none may stay away, not even one that cannot go on.
  const index_t count = std::ssize(order);
  if (ranks != nullptr) ranks->deal(count);
  if (monitor.stop.stop_requested()) {
    take_all_tickets(ranks);
    throw cancelled{};
  }
  for (const index_t t : order) {
    costs.push_back(cost(t));
    points += double(survey.tiles[t].points);
  }
  std::atomic<index_t> taken = 0;
  std::function<std::optional<index_t>()> next = [&]() -> std::optional<index_t> {
    const index_t i = taken++;
    return i < count ? std::optional{i} : std::nullopt;
  };
  if (ranks != nullptr) next = ranks->next_ticket;
  const std::function<void(index_t)> work_on = [&](index_t i) { work(order[i]); };
  const index_t most = threads > 0 ? threads : detail::threads_of_part(1);
  crew all{costs, survey.memory, next, work_on, monitor};
  all.run(static_cast<int>(std::max<index_t>(1, std::min(most, count))),
          [&](index_t i) { return double(survey.tiles[order[i]].points) / std::max(points, 1.0); });
}

template void run_all(const tile_survey<2>&, const process_group*, std::span<const index_t>, int,
                      const std::function<std::uint64_t(index_t)>&,
                      const std::function<void(index_t)>&, const task_monitor&);
template void run_all(const tile_survey<3>&, const process_group*, std::span<const index_t>, int,
                      const std::function<std::uint64_t(index_t)>&,
                      const std::function<void(index_t)>&, const task_monitor&);

}  // namespace cilantro
