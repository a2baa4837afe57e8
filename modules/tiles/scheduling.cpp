// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <numeric>
#include <span>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "core/parallel_backend.hpp"
module cilantro.tiles;

import :running;
import :survey;

namespace cilantro {
namespace {

/// Threads that take the next tile as soon as there is memory for it.
class crew {
 public:
  crew(std::span<const index_t> tiles, std::span<const std::uint64_t> costs, std::uint64_t memory,
       const std::function<void(index_t)>& work, const task_monitor& monitor)
      : tiles_{tiles}, costs_{costs}, memory_{memory}, work_{work}, monitor_{monitor} {}

  void run(int threads, const std::function<double(std::size_t)>& weight) {
    weight_ = weight;
    const int each = detail::threads_of_part(threads);
    std::vector<std::thread> others;
    others.reserve(static_cast<std::size_t>(threads));
    for (int t = 0; t < threads; ++t) {
      try {
        others.emplace_back([this, each] {
          detail::use_threads(each);
          while (take_one()) {
          }
        });
      } catch (const std::system_error&) {
        if (others.empty()) throw;
        break;  // Fewer threads give the same results.
      }
    }
    watch_until_done();
    for (auto& thread : others) thread.join();
    if (error_) std::rethrow_exception(error_);
    if (monitor_.stop.stop_requested()) throw cancelled{};
    if (monitor_.progress) monitor_.progress(1);
  }

 private:
  bool take_one() {
    std::size_t next = 0;
    {
      std::unique_lock lock{mutex_};
      // In order, so that a large tile does not wait for ever while small ones go by.
      changed_.wait(
          lock, [&] { return is_over() || in_use_ == 0 || in_use_ + costs_[next_] <= memory_; });
      if (is_over()) return false;
      next = next_++;
      in_use_ += costs_[next];
    }
    std::exception_ptr error;
    try {
      work_(tiles_[next]);
    } catch (...) {
      error = std::current_exception();
    }
    const std::scoped_lock lock{mutex_};
    in_use_ -= costs_[next];
    ++done_;
    share_ += weight_(next);
    if (error && !error_) error_ = error;
    changed_.notify_all();
    return true;
  }

  [[nodiscard]] bool is_over() const {
    return error_ || next_ == tiles_.size() || monitor_.stop.stop_requested();
  }

  /// On the thread of the caller, which is the one that progress is reported on.
  void watch_until_done() {
    std::unique_lock lock{mutex_};
    double reported = 0;
    while (!is_over() || done_ < next_) {
      changed_.wait_for(lock, std::chrono::milliseconds{100});
      if (!monitor_.progress || share_ <= reported) continue;
      reported = share_;
      lock.unlock();
      try {
        monitor_.progress(std::min(reported, 1.0));
      } catch (...) {
        lock.lock();
        if (!error_) error_ = std::current_exception();
        continue;
      }
      lock.lock();
    }
    changed_.notify_all();
  }

  std::span<const index_t> tiles_;
  std::span<const std::uint64_t> costs_;
  std::uint64_t memory_;
  const std::function<void(index_t)>& work_;
  const task_monitor& monitor_;
  std::function<double(std::size_t)> weight_;

  std::mutex mutex_;  // Of all below.
  std::condition_variable changed_;
  std::size_t next_ = 0, done_ = 0;
  std::uint64_t in_use_ = 0;
  double share_ = 0;
  std::exception_ptr error_;
};

}  // namespace

template <int D>
void run_all(const tile_survey<D>& survey, std::span<const index_t> tiles, int threads,
             const std::function<std::uint64_t(index_t)>& cost,
             const std::function<void(index_t)>& work, const task_monitor& monitor) {
  if (monitor.stop.stop_requested()) throw cancelled{};
  std::vector<index_t> order(tiles.begin(), tiles.end());
  std::ranges::sort(order, std::ranges::greater{},
                    [&](index_t t) { return std::pair{survey.tiles[t].points, -t}; });
  std::vector<std::uint64_t> costs;
  double points = 0;
  for (const index_t t : order) {
    costs.push_back(cost(t));
    points += double(survey.tiles[t].points);
  }
  const int most = threads > 0 ? threads : detail::threads_of_part(1);
  crew all{order, costs, survey.memory, work, monitor};
  all.run(std::max(1, static_cast<int>(std::min<std::size_t>(most, order.size()))),
          [&](std::size_t i) { return double(survey.tiles[order[i]].points) / points; });
}

template void run_all(const tile_survey<2>&, std::span<const index_t>, int,
                      const std::function<std::uint64_t(index_t)>&,
                      const std::function<void(index_t)>&, const task_monitor&);
template void run_all(const tile_survey<3>&, std::span<const index_t>, int,
                      const std::function<std::uint64_t(index_t)>&,
                      const std::function<void(index_t)>&, const task_monitor&);

}  // namespace cilantro
