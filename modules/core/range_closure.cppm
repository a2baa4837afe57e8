// SPDX-License-Identifier: MIT
module;
#include "core/feature_macros.hpp"
export module cilantro.core:range_closure;

import cilantro.standard;

namespace cilantro {

/// Whether a T may stand beside a closure of ranges in `closure | t`. False for steps of pipelines,
/// which clouds are sent through and not ranges.
export template <class T>
inline constexpr bool composes_with_closures = std::is_class_v<T> && !std::ranges::range<T>;

/// A function of a range that can stand behind `|`: `range | closure` is `closure(range)`, and
/// `closure | other` applies both, one after the other. `other` is a closure of this kind or of
/// `std::views`: `each(f) | std::views::take(3)`. Where the standard library has one, it is a range
/// adaptor closure of that library.
export template <class F>
struct range_closure;
/// Whether T is a `range_closure`.
export template <class T>
inline constexpr bool is_range_closure = false;
template <class F>
inline constexpr bool is_range_closure<range_closure<F>> = true;

#ifdef CILANTRO_STANDARD_CLOSURES

template <class F>
struct range_closure : std::ranges::range_adaptor_closure<range_closure<F>> {
  F function;  ///< The function.

  constexpr explicit range_closure(F f) : function(std::move(f)) {}
  template <std::ranges::range R>
    requires std::invocable<const F&, R>
  constexpr decltype(auto) operator()(R&& range) const {
    return std::invoke(function, std::forward<R>(range));
  }
};

#else

template <class F>
struct range_closure {
  F function;  ///< The function.

  constexpr explicit range_closure(F f) : function(std::move(f)) {}
  template <std::ranges::range R>
    requires std::invocable<const F&, R>
  constexpr decltype(auto) operator()(R&& range) const {
    return std::invoke(function, std::forward<R>(range));
  }

  template <std::ranges::range R>
    requires std::invocable<const F&, R>
  friend constexpr decltype(auto) operator|(R&& range, const range_closure& closure) {
    return closure(std::forward<R>(range));
  }
  template <class G>
    requires composes_with_closures<G>
  [[nodiscard]] friend constexpr auto operator|(range_closure first, G second) {
    return compose(std::move(first), std::move(second));
  }
  template <class G>
    requires composes_with_closures<G> && (!is_range_closure<G>)
  [[nodiscard]] friend constexpr auto operator|(G first, range_closure second) {
    return compose(std::move(first), std::move(second));
  }

 private:
  template <class A, class B>
  static constexpr auto compose(A first, B second) {
    auto both = [first = std::move(first), second = std::move(second)]<class R>(
                    R&& range) -> decltype(std::forward<R>(range) | first | second) {
      return std::forward<R>(range) | first | second;
    };
    return range_closure<decltype(both)>{std::move(both)};
  }
};

#endif

}  // namespace cilantro
