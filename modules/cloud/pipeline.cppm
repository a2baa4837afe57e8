// SPDX-License-Identifier: MIT
export module cilantro.cloud:pipeline;

import cilantro.standard;
import :point_cloud;

namespace cilantro {

/// A function that a cloud of type C can be piped into: it takes the cloud, usually `C&&` or by
/// value, and usually returns a cloud.
export template <class F, class C>
concept StepFor = PointCloud<C> && std::invocable<const F&, C>;

/// A step of a pipeline: `cloud | step` is `step(cloud)`, and `a | b` is the step "a, then b".
///
/// Eager: every step returns a finished value, and a temporary cloud is moved through the whole
/// line. A value like any other: store it, copy it, use it in `std::views::transform` over frames.
/// Your own step is a lambda: `cloud | [](auto cloud) { …; return cloud; }`, and `step{lambda}`
/// where a line of steps begins with it.
export template <class F>
struct step {
  F function;

  template <class C>
    requires StepFor<F, C>
  decltype(auto) operator()(C&& cloud) const {
    return std::invoke(function, std::forward<C>(cloud));
  }

  template <PointCloud C>
    requires StepFor<F, C>
  friend decltype(auto) operator|(C&& cloud, const step& s) {
    return s(std::forward<C>(cloud));
  }

  template <class G>
  [[nodiscard]] friend auto operator|(step first, step<G> second) {
    return cilantro::step{
        [first = std::move(first),
         second = std::move(second)]<PointCloud C>(C&& c) -> decltype(auto)
          requires StepFor<F, C> &&
                   std::invocable<const step<G>&, std::invoke_result_t<const F&, C>>
        { return second(first(std::forward<C>(c))); }};
  }
};
export template <class F>
step(F) -> step<F>;

template <class F>
inline constexpr bool is_step = false;
template <class F>
inline constexpr bool is_step<step<F>> = true;

/// A function that is no `step` is one all the same behind a cloud, and behind a step.
export template <PointCloud C, class F>
  requires(!is_step<F>) && StepFor<F, C>
decltype(auto) operator|(C&& cloud, const F& function) {
  return std::invoke(function, std::forward<C>(cloud));
}
export template <class F, class G>
  requires(!is_step<G>) && (std::is_class_v<G> || std::is_pointer_v<G>)
[[nodiscard]] auto operator|(step<F> first, G second) {
  return std::move(first) | step{std::move(second)};
}

}  // namespace cilantro
