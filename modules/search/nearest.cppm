// SPDX-License-Identifier: MIT
//
// How a search keeps the best candidates so far. Internal.
export module cilantro.search:nearest;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// A point that may be among the neighbours: its sum and its index in one integer that sorts by
/// sum, then index, since the bits of non-negative floating-point numbers sort as the numbers do.
template <Scalar S>
class candidate {
 public:
  candidate() = default;
  candidate(S sum, std::int32_t index)
      : key_{key{std::bit_cast<sum_bits>(sum)} << index_bits | static_cast<std::uint32_t>(index)} {}

  [[nodiscard]] S sum() const {
    return std::bit_cast<S>(static_cast<sum_bits>(key_ >> index_bits));
  }
  [[nodiscard]] std::int32_t index() const {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(key_));
  }
  friend auto operator<=>(candidate a, candidate b) = default;

 private:
  using sum_bits = std::conditional_t<sizeof(S) == 4, std::uint32_t, std::uint64_t>;
  using key = std::conditional_t<sizeof(S) == 4, std::uint64_t, unsigned __int128>;
  static constexpr int index_bits = 32;
  key key_;
};

/// The best k so far in a sorted array: the fastest way while k is small.
template <Scalar S>
class sorted_result {
 public:
  sorted_result(std::span<candidate<S>> room, S limit)
      : best_{room.data()}, capacity_{room.size()}, worst_{limit} {}

  [[nodiscard]] std::size_t size() const { return count_; }
  /// No sum above this can enter any more.
  [[nodiscard]] S worst() const { return worst_; }
  void add(S sum, std::int32_t index) {
    if (!(sum <= worst_)) return;
    const candidate<S> next{sum, index};
    const bool full = count_ == capacity_;
    if (full && !(next < best_[count_ - 1])) return;
    std::size_t at = full ? count_ - 1 : count_++;
    for (; at > 0 && next < best_[at - 1]; --at) best_[at] = best_[at - 1];
    best_[at] = next;
    if (count_ == capacity_) worst_ = best_[count_ - 1].sum();
  }

 private:
  candidate<S>* best_;
  std::size_t capacity_, count_ = 0;
  S worst_;
};

/// The best k so far in a heap, for large k, and for all points within a radius.
template <Scalar S>
class heap_result {
 public:
  heap_result(std::vector<candidate<S>>& heap, std::size_t capacity, S limit)
      : heap_{heap}, capacity_{capacity}, worst_{limit} {
    heap_.clear();
  }

  [[nodiscard]] S worst() const { return worst_; }
  void add(S sum, std::int32_t index) {
    if (!(sum <= worst_)) return;
    const candidate<S> next{sum, index};
    if (heap_.size() < capacity_) {
      heap_.push_back(next);
      if (heap_.size() < capacity_) return;
      std::ranges::make_heap(heap_);
    } else if (next < heap_.front()) {
      std::ranges::pop_heap(heap_);
      heap_.back() = next;
      std::ranges::push_heap(heap_);
    }
    worst_ = heap_.front().sum();
  }
  void sort() { std::ranges::sort(heap_); }

 private:
  std::vector<candidate<S>>& heap_;
  std::size_t capacity_;
  S worst_;
};

/// The best two so far, without a branch that depends on the points.
template <Scalar S>
class two_nearest_result {
 public:
  explicit two_nearest_result(S limit) : first_{limit, nobody}, second_{limit, nobody} {}

  [[nodiscard]] S worst() const { return second_.sum(); }
  void add(S sum, std::int32_t index) {
    const candidate<S> next{sum, index};
    second_ = std::min(second_, std::max(first_, next));
    first_ = std::min(first_, next);
  }
  /// Passes those that were found to `write(index, sum)`.
  template <class F>
  void write(F&& write) const {
    for (const auto& c : {first_, second_})
      if (c.index() != nobody) write(c.index(), c.sum());
  }

 private:
  /// Larger than every index, so that a point exactly at the limit sorts before it.
  static constexpr std::int32_t nobody = std::numeric_limits<std::int32_t>::max();
  candidate<S> first_, second_;
};

/// Beyond this many neighbours, moving a sorted array costs more than a heap.
inline constexpr std::size_t most_sorted = 64;

/// Memory that a thread reuses from query to query.
template <Scalar S>
struct search_scratch {
  std::array<candidate<S>, most_sorted> sorted;
  std::vector<candidate<S>> heap;
};

}  // namespace cilantro
