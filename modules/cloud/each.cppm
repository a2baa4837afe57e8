// SPDX-License-Identifier: MIT
export module cilantro.cloud:each;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

export struct each_options {
  /// So many frames are prepared by as many other threads while those before them are used; 0: each
  /// frame when it is asked for, by the thread that asks.
  int ahead = 0;
};

/// Tasks that are done by other threads before they are asked for, and handed out in their order.
class work_ahead {
 public:
  /// `take(slot)` fetches the input of the next task, one at a time and in order, and returns false
  /// if there is none; `work(slot)` does it. Slots are numbered from 0 to `ahead`, and one is not
  /// used again before its task has been released.
  work_ahead(int ahead, std::function<bool(index_t slot)> take,
             std::function<void(index_t slot)> work);
  /// Waits until no thread works any more; tasks that have not begun are left.
  ~work_ahead();
  work_ahead(const work_ahead&) = delete;
  work_ahead& operator=(const work_ahead&) = delete;

  /// Whether there is no further task. Waits until that is known.
  [[nodiscard]] bool at_end();
  /// The slot of the first task that has not been released, when it is done. Throws what taking or
  /// doing it has thrown. Precondition: not `at_end()`.
  index_t wait();
  /// Leaves the first task, so that its slot can be used again.
  void release();

 private:
  struct state;
  std::unique_ptr<state> state_;
};

/// What `each` gives: the frames of a range, each sent through a function once, however often it is
/// looked at. An input range, to be gone through from its beginning: `begin()` starts anew where
/// the frames allow it. Elements are lvalues that live until the next is asked for, and may be
/// moved from.
export template <std::ranges::view V, class F>
  requires std::ranges::input_range<V> &&
           std::invocable<const F&, std::ranges::range_reference_t<V>>
class each_view : public std::ranges::view_interface<each_view<V, F>> {
  using result_type =
      std::remove_cvref_t<std::invoke_result_t<const F&, std::ranges::range_reference_t<V>>>;
  struct state {
    V frames;
    F function;
    each_options options;
    std::optional<std::ranges::iterator_t<V>> next = {};
    std::vector<std::optional<result_type>> done = {};
    std::vector<std::optional<std::ranges::range_value_t<V>>> taken = {};
    std::vector<std::remove_reference_t<std::ranges::range_reference_t<V>>*> seen = {};
    std::unique_ptr<work_ahead> ahead = {};
  };

 public:
  class iterator {
   public:
    using value_type = result_type;
    using difference_type = std::ptrdiff_t;
    using iterator_concept = std::input_iterator_tag;

    iterator() = default;
    explicit iterator(state* all) : all_{all} {}

    [[nodiscard]] result_type& operator*() const {
      if (all_->ahead) return *all_->done[all_->ahead->wait()];
      auto& done = all_->done.front();
      if (!done) done.emplace(std::invoke(std::as_const(all_->function), **all_->next));
      return *done;
    }
    iterator& operator++() {
      if (all_->ahead) {
        all_->ahead->release();
      } else {
        all_->done.front().reset();
        ++*all_->next;
      }
      return *this;
    }
    void operator++(int) { ++*this; }
    friend bool operator==(const iterator& i, std::default_sentinel_t) {
      return i.all_->ahead ? i.all_->ahead->at_end()
                           : *i.all_->next == std::ranges::end(i.all_->frames);
    }

   private:
    state* all_ = nullptr;
  };

  each_view(V frames, F function, each_options options)
      : state_{std::make_unique<state>(std::move(frames), std::move(function), options)} {
    expect_from(0, options.ahead, "each: ahead");
  }

  [[nodiscard]] iterator begin() {
    state& all = *state_;
    all.ahead.reset();
    all.done.clear();
    all.done.resize(static_cast<std::size_t>(all.options.ahead) + 1);
    all.next.emplace(std::ranges::begin(all.frames));
    if (all.options.ahead > 0) start_ahead();
    return iterator{&all};
  }
  [[nodiscard]] std::default_sentinel_t end() const { return {}; }

 private:
  // Whether a frame stays where it is while later ones are fetched.
  static constexpr bool frames_stay = std::ranges::forward_range<V> &&
                                      std::is_lvalue_reference_v<std::ranges::range_reference_t<V>>;

  void start_ahead() {
    state* all = state_.get();
    all->taken.resize(all->done.size());
    all->seen.resize(all->done.size());
    all->ahead = std::make_unique<work_ahead>(
        all->options.ahead,
        [all](index_t slot) {
          if (*all->next == std::ranges::end(all->frames)) return false;
          if constexpr (frames_stay)
            all->seen[slot] = &**all->next;
          else
            all->taken[slot].emplace(**all->next);
          ++*all->next;
          return true;
        },
        [all](index_t slot) {
          auto& done = all->done[slot];
          done.reset();
          const F& function = all->function;
          if constexpr (frames_stay)
            done.emplace(std::invoke(function, *all->seen[slot]));
          else if constexpr (std::is_lvalue_reference_v<std::ranges::range_reference_t<V>>)
            done.emplace(std::invoke(function, *all->taken[slot]));
          else
            done.emplace(std::invoke(function, std::move(*all->taken[slot])));
          all->taken[slot].reset();
        });
  }

  std::unique_ptr<state> state_;
};

/// Sends each frame of a range through a step, or any function: `frames | each(prepare)`, a view as
/// those of the standard library, lazy, in which each frame is done once however the views behind
/// it ask. With `.ahead`, other threads prepare the next ones while one is used: the same results
/// in the same order, and an exception of a frame arrives where that frame is asked for. Threads
/// that OpenMP would use are then shared between them. The function is called by several threads at
/// once, and the frames are fetched by one at a time; leaving early waits for what has begun.
/// Throws `invalid_input` for a negative `ahead`.
export template <class F>
[[nodiscard]] auto each(F function, each_options options = {}) {
  return range_closure{
      [function = std::move(function), options]<std::ranges::viewable_range R>(R&& frames)
        requires std::invocable<const F&,
                                std::ranges::range_reference_t<std::ranges::views::all_t<R>>>
      {
        using view = std::ranges::views::all_t<R>;
        return each_view<view, F>{std::views::all(std::forward<R>(frames)), function, options};
      }};
}

}  // namespace cilantro
