// SPDX-License-Identifier: MIT
//
// Ranks that are threads of one process: what `cilantro::mpi::communicator` offers, without MPI, so
// that the same tests run anywhere. And what ranks must do, whatever they are.
module;
#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <mutex>
#include <numeric>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>
export module rank_support;

import cilantro;

namespace test {

/// What waits for a rank that is gone gets this.
export class rank_is_lost : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A job of several ranks, each a thread.
export class in_process_ranks {
 public:
  explicit in_process_ranks(int size) : given_(std::size_t(size)), calls_(std::size_t(size)) {}

  /// One of them, for the thread that is it; only `next_ticket` may be called by others, too.
  class rank_of_process {
   public:
    rank_of_process(in_process_ranks& job, int rank) : job_{&job}, rank_{rank} {}
    [[nodiscard]] int rank() const { return rank_; }
    [[nodiscard]] int size() const { return int(job_->given_.size()); }
    [[nodiscard]] std::vector<std::vector<std::byte>> all_gather(std::span<const std::byte> mine) {
      return job_->gather(rank_, "all_gather", {mine.begin(), mine.end()});
    }
    void deal(std::ptrdiff_t count) {
      (void)job_->gather(rank_, "deal " + std::to_string(count), {}, count);
    }
    [[nodiscard]] std::optional<std::ptrdiff_t> next_ticket() {
      const std::lock_guard lock{job_->mutex_};
      if (job_->next_ == job_->count_) return {};
      return job_->next_++;
    }

   private:
    in_process_ranks* job_;
    int rank_;
  };

  /// Runs `f(rank)` on all ranks. If one throws, all that wait for it end, and a sentence that
  /// names it is thrown.
  template <class F>
  void run(F f) {
    std::vector<std::thread> threads;
    for (int rank = 0; rank < int(given_.size()); ++rank)
      threads.emplace_back([this, rank, &f] {
        rank_of_process mine{*this, rank};
        try {
          f(mine);
        } catch (const rank_is_lost&) {  // It is the other that counts.
        } catch (const std::exception& what) {
          lose(rank, what.what());
        }
      });
    for (std::thread& thread : threads) thread.join();
    if (!lost_.empty()) throw std::runtime_error{lost_};
  }

 private:
  std::vector<std::vector<std::byte>> gather(int rank, std::string call,
                                             std::vector<std::byte> mine,
                                             std::optional<std::ptrdiff_t> count = {}) {
    std::unique_lock lock{mutex_};
    given_[std::size_t(rank)] = std::move(mine);
    calls_[std::size_t(rank)] = std::move(call);
    const int turn = turn_;
    if (++arrived_ == int(given_.size())) {
      arrived_ = 0;
      ++turn_;
      gathered_ = given_;
      if (count) {
        next_ = 0;
        count_ = *count;
      }
      for (const std::string& other : calls_)
        if (other != calls_[0] && lost_.empty())
          lost_ = "rank 0: " + calls_[0] + ", but another: " + other;
      all_there_.notify_all();
    } else {
      all_there_.wait(lock, [&] { return turn_ != turn || !lost_.empty(); });
    }
    if (!lost_.empty()) throw rank_is_lost{lost_};
    return gathered_;
  }

  void lose(int rank, const std::string& what) {
    const std::lock_guard lock{mutex_};
    if (lost_.empty()) lost_ = "rank " + std::to_string(rank) + ": " + what;
    all_there_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable all_there_;
  std::vector<std::vector<std::byte>> given_, gathered_;
  std::vector<std::string> calls_;
  int arrived_ = 0, turn_ = 0;
  std::ptrdiff_t next_ = 0, count_ = 0;
  std::string lost_;
};

export inline void require(bool condition, const std::string& what) {
  if (!condition) throw std::runtime_error{"a rank's contract is broken: " + what};
}

inline std::uint64_t hash_of(std::span<const std::byte> bytes) {
  std::uint64_t hash = 14695981039346656037u;  // FNV-1a.
  for (const std::byte b : bytes) hash = (hash ^ std::uint64_t(b)) * 1099511628211u;
  return hash;
}

/// `size` bytes that differ from rank to rank.
inline std::vector<std::byte> bytes_of(int rank, std::size_t size) {
  std::vector<std::byte> bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = std::byte((i * 31 + i / 251 + rank * 7) % 256);
  return bytes;
}

/// Takes tickets of a round on several threads, until there are none; ascending.
template <class C>
std::vector<std::ptrdiff_t> tickets_taken(C& ranks, int threads) {
  std::mutex mutex;
  std::vector<std::ptrdiff_t> all;
  std::vector<std::thread> takers;
  for (int t = 0; t < threads; ++t)
    takers.emplace_back([&] {
      std::ptrdiff_t before = -1;
      while (const auto ticket = ranks.next_ticket()) {
        require(*ticket > before, "tickets ascend");
        before = *ticket;
        const std::lock_guard lock{mutex};
        all.push_back(before);
      }
    });
  for (std::thread& taker : takers) taker.join();
  std::ranges::sort(all);
  return all;
}

/// The tickets that all ranks have, together, ascending.
template <class C>
std::vector<std::ptrdiff_t> of_all_ranks(C& ranks, const std::vector<std::ptrdiff_t>& mine) {
  std::vector<std::ptrdiff_t> all;
  for (const auto& bytes : ranks.all_gather(std::as_bytes(std::span{mine}))) {
    std::vector<std::ptrdiff_t> theirs(bytes.size() / sizeof(std::ptrdiff_t));
    std::ranges::copy(bytes, std::as_writable_bytes(std::span{theirs}).begin());
    all.insert(all.end(), theirs.begin(), theirs.end());
  }
  std::ranges::sort(all);
  return all;
}

inline bool counts_up(const std::vector<std::ptrdiff_t>& tickets, std::ptrdiff_t count) {
  std::vector<std::ptrdiff_t> wanted(static_cast<std::size_t>(count));
  std::iota(wanted.begin(), wanted.end(), 0);
  return tickets == wanted;
}

/// Goes through all that ranks can do, and throws where it is wrong. Returns a hash that depends on
/// how many there are only. `most` is the size of the largest part that is gathered.
export template <class C>
std::uint64_t check_ranks(C& ranks, std::size_t most) {
  const int rank = ranks.rank(), size = ranks.size();
  require(0 <= rank && rank < size, "the rank is below the size");
  std::uint64_t hash = 0;

  // Nothing, a little, and parts of different sizes, some empty.
  for (const std::size_t scale : {std::size_t{0}, std::size_t{1}, std::size_t{1000}, most}) {
    const auto size_of = [&](int r) { return r % 3 == 1 ? 0 : scale / (std::size_t(r) + 1); };
    const auto all = ranks.all_gather(bytes_of(rank, size_of(rank)));
    require(std::ssize(all) == size, "a part of each rank is gathered");
    for (int r = 0; r < size; ++r) {
      require(all[std::size_t(r)] == bytes_of(r, size_of(r)), "parts are gathered by rank");
      hash = hash * 31 + hash_of(all[std::size_t(r)]);
    }
  }

  // Without a round, in rounds with fewer tickets than ranks, and with many.
  require(!ranks.next_ticket(), "there are no tickets before a round");
  for (const std::ptrdiff_t count : {0, 1, 3, 500}) {
    ranks.deal(count);
    const auto mine = tickets_taken(ranks, 1 + rank % 3);
    require(!ranks.next_ticket(), "there is none when all are taken");
    require(counts_up(of_all_ranks(ranks, mine), count), "each ticket goes to one rank");
  }
  // A round that ends before all are taken, and one right after.
  ranks.deal(1000);
  if (rank % 2 == 0) (void)ranks.next_ticket();
  ranks.deal(7);
  const auto of_second = tickets_taken(ranks, 1);
  require(counts_up(of_all_ranks(ranks, of_second), 7), "a new round ends the one before");

  // Rank 0 computes: the others need not wait.
  ranks.deal(5);
  std::vector<std::ptrdiff_t> mine;
  if (rank == 0 && size > 1) {
    volatile double sum = 0;
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds{1500};
    while (std::chrono::steady_clock::now() < end) sum = sum + 1;
  }
  mine = tickets_taken(ranks, 1);
  require(rank != 0 || size == 1 || mine.empty(), "rank 0 deals while it computes");
  require(counts_up(of_all_ranks(ranks, mine), 5), "those who are free take all");

  // A sum over all ranks has the bits of a sum in one piece, whoever adds what.
  ranks.deal(64);
  cilantro::exact_sum part, whole;
  const auto add = [](cilantro::exact_sum& sum, std::ptrdiff_t block) {
    cilantro::random_stream random{9, std::uint64_t(block)};
    for (int i = 0; i < 100; ++i) sum += random.normal() / (1 + 1e6 * random.uniform());
  };
  while (const auto block = ranks.next_ticket()) add(part, *block);
  for (std::ptrdiff_t block = 0; block < 64; ++block) add(whole, block);
  cilantro::exact_sum sum;
  for (const auto& bytes : ranks.all_gather(std::as_bytes(std::span{part.limbs()}))) {
    cilantro::exact_sum theirs;
    std::ranges::copy(bytes, std::as_writable_bytes(std::span{theirs.limbs()}).begin());
    sum += theirs;
  }
  require(sum == whole, "sums over ranks are those of one");
  return hash * 31 + std::bit_cast<std::uint64_t>(sum.value());
}

}  // namespace test
