// SPDX-License-Identifier: MIT
export module cilantro.cloud:each;

import cilantro.standard;
import cilantro.core;
import :pipeline;

namespace cilantro {

/// Options of `each`.
export struct each_options {
  /// How many frames are prepared ahead, each by a thread of its own, while an earlier one is used.
  /// 0: each frame is prepared when it is needed, by the thread that needs it.
  int ahead = 0;
};

/// A function that makes something of a frame, which can be kept.
template <class F, class Frame>
concept GivesFrame = std::invocable<const F&, Frame> &&
                     std::movable<std::remove_cvref_t<std::invoke_result_t<const F&, Frame>>>;

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
/// can. Elements are lvalues that may be moved from; they, and the frames they were made of, live
/// until the iterator is advanced.
export template <std::ranges::view V, class F>
  requires std::ranges::input_range<V> &&
           std::invocable<const F&, std::ranges::range_reference_t<V>>
class each_view : public std::ranges::view_interface<each_view<V, F>> {
  using reference = std::ranges::range_reference_t<V>;
  using result_type = std::remove_cvref_t<std::invoke_result_t<const F&, reference>>;
  static constexpr bool are_lvalues = std::is_lvalue_reference_v<reference>;
  // What of a frame is kept while later ones are fetched, unless it stays where it is.
  using kept_type =
      std::conditional_t<are_lvalues || !std::ranges::forward_range<V>,
                         std::ranges::range_value_t<V>, std::remove_cvref_t<reference>>;
  using kept_argument = std::conditional_t<are_lvalues, kept_type&, kept_type&&>;
  static constexpr bool can_be_kept =
      std::constructible_from<kept_type, reference> && std::invocable<const F&, kept_argument>;

  struct slot {
    std::remove_reference_t<reference>* seen = nullptr;
    std::optional<kept_type> kept = {};
    std::exception_ptr error = {};
    std::optional<result_type> done = {};  // May refer to what was kept.

    void clear() {
      done.reset();
      kept.reset();
      seen = nullptr;
      error = {};
    }
  };

  struct state {
    V frames;
    F function;
    each_options options;
    std::optional<std::ranges::iterator_t<V>> next = {};
    std::vector<slot> slots = {};
    std::unique_ptr<work_ahead> ahead = {};  // Ends before what it works on.

    // Remembers the next frame, which is kept if it may be gone later.
    void fetch(slot& s, bool may_be_gone) {
      s.clear();
      if constexpr (are_lvalues)
        if (!may_be_gone) {
          s.seen = &**next;
          return;
        }
      if constexpr (can_be_kept) s.kept.emplace(**next);
    }
    void make(slot& s) const {
      if constexpr (are_lvalues)
        if (s.seen) {
          s.done.emplace(std::invoke(function, *s.seen));
          return;
        }
      if constexpr (can_be_kept)
        s.done.emplace(std::invoke(function, static_cast<kept_argument>(*s.kept)));
    }
    // As `fetch`, where an exception must wait until the frame is asked for.
    bool fetch_ahead(slot& s) {
      if (*next == std::ranges::end(frames)) return false;
      try {
        fetch(s, !std::ranges::forward_range<V>);
      } catch (...) {
        s.error = std::current_exception();
      }
      ++*next;
      return true;
    }
    void make_ahead(slot& s) const {
      if (s.error) std::rethrow_exception(s.error);
      make(s);
    }
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
      if (all_->ahead) return *all_->slots[all_->ahead->wait()].done;
      auto& only = all_->slots.front();
      if (!only.done) {
        all_->fetch(only, false);
        all_->make(only);
      }
      return *only.done;
    }
    iterator& operator++() {
      if (all_->ahead) {
        all_->ahead->release();
      } else {
        all_->slots.front().clear();
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
    expect_between(0, options.ahead, 10'000, "each: ahead");
    expects(
        options.ahead == 0 || !writes_outside_of(state_->function),
        "each: the step " + name_of(state_->function) +
            " writes to something that all frames share, so that they cannot be prepared ahead");
    expects(options.ahead == 0 || can_be_kept,
            "each: these frames cannot be kept while later ones are fetched, so that they cannot "
            "be prepared ahead");
  }

  [[nodiscard]] iterator begin() {
    state* all = state_.get();
    all->ahead.reset();
    all->slots.clear();
    all->slots.resize(static_cast<std::size_t>(all->options.ahead) + 1);
    all->next.emplace(std::ranges::begin(all->frames));
    if (all->options.ahead > 0)
      all->ahead = std::make_unique<work_ahead>(
          all->options.ahead, [all](index_t s) { return all->fetch_ahead(all->slots[s]); },
          [all](index_t s) { all->make_ahead(all->slots[s]); });
    return iterator{all};
  }
  [[nodiscard]] std::default_sentinel_t end() const { return {}; }

 private:
  std::unique_ptr<state> state_;
};

/// Whether the frames of a range may be moved from, since nobody else holds them.
template <class R>
inline constexpr bool hands_frames_over = false;
template <class V, class F>
inline constexpr bool hands_frames_over<each_view<V, F>> = true;

/// Sends each frame of a range through a step, or any function: `frames | each(prepare)`. The
/// result is a lazy view, as in the standard library, but processes each frame only once, however
/// often later views read it. With `.ahead`, other threads prepare the next frames while one is
/// used: the results and their order stay the same, and an exception for a frame is thrown where
/// that frame is read. These threads share the threads that OpenMP would use. The function is then
/// called by several threads at once, while frames are fetched by one thread at a time; leaving the
/// loop early waits for the frames that have been begun. Frames that do not stay where they are, as
/// those of a stream, are kept meanwhile. Throws `invalid_input` for an `ahead` that is negative or
/// above 10,000, and with `.ahead` for a step that writes outside of the cloud, such as a report.
export template <std::copy_constructible F>
[[nodiscard]] auto each(F function, each_options options = {}) {
  return range_closure{
      [function = std::move(function), options]<std::ranges::viewable_range R>(R&& frames)
        requires GivesFrame<F, std::ranges::range_reference_t<std::ranges::views::all_t<R>>>
      {
        using view = std::ranges::views::all_t<R>;
        return each_view<view, F>{std::views::all(std::forward<R>(frames)), function, options};
      }};
}

}  // namespace cilantro
