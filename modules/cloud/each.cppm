// SPDX-License-Identifier: MIT
export module cilantro.cloud:each;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// Options of `each`.
export struct each_options {
  /// How many frames are prepared ahead, each by a thread of its own, while an earlier one is used.
  /// 0: each frame is prepared when it is needed, by the thread that needs it.
  int ahead = 0;
};

/// Tasks that other threads do ahead of time; their results are handed out in order.
class work_ahead {
 public:
  /// `take(slot)` fetches the input of the next task, one at a time and in order, and returns false
  /// if there is none; `work(slot)` does it. Slots are numbered from 0 to `ahead`; a slot is not
  /// reused before its task has been released.
  work_ahead(int ahead, std::function<bool(index_t slot)> take,
             std::function<void(index_t slot)> work);
  /// Waits for the tasks that have begun, and drops the others.
  ~work_ahead();
  work_ahead(const work_ahead&) = delete;
  work_ahead& operator=(const work_ahead&) = delete;

  /// Whether there are no more tasks. Waits until that is known.
  [[nodiscard]] bool at_end();
  /// Waits until the first task that has not been released is done, and returns its slot. Throws
  /// what taking or doing the task has thrown. Precondition: not `at_end()`.
  index_t wait();
  /// Releases the first task, so that its slot can be reused.
  void release();

 private:
  struct state;
  std::unique_ptr<state> state_;
};

/// The view that `each` returns: the frames of a range, each sent through a function exactly once,
/// however often the element is read. An input range; `begin()` starts again if the range of frames
/// can. Elements are lvalues that live until the iterator is advanced, and may be moved from.
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
  /// An input iterator over the results.
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

/// Sends each frame of a range through a step, or any function: `frames | each(prepare)`. The
/// result is a lazy view, as in the standard library, but processes each frame only once, however
/// often later views read it. With `.ahead`, other threads prepare the next frames while one is
/// used: the results and their order stay the same, and an exception for a frame is thrown where
/// that frame is read. These threads share the threads that OpenMP would use. The function is then
/// called by several threads at once, while frames are fetched by one thread at a time; leaving the
/// loop early waits for the frames that have been begun. Throws `invalid_input` for a negative
/// `ahead`.
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
