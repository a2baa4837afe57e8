// SPDX-License-Identifier: MIT
export module cilantro.cloud:pipeline;

import cilantro.standard;
import cilantro.core;
import :choice;
import :point_cloud;

namespace cilantro {

/// A function that a cloud of type C can be piped into: it takes the cloud, usually `C&&` or by
/// value, and usually returns a cloud.
export template <class F, class C>
concept StepFor = PointCloud<C> && std::invocable<const F&, C>;

/// The base of all steps of the library, which lets `|` combine them. A step is a value with a call
/// operator that can be copied, assigned, stored and queried. A step of yours is a lambda or a
/// struct; if it derives from this, it may also stand at the beginning of a pipeline.
///
/// Optional members describe a step: `name`, a string for reports; `needs()`, the `cloud_parts`
/// that it requires; `gives()`, the `cloud_parts` that its result always has; `reach()`, how far
/// around a point it looks, as `step_reach`; `writes_outside()`, whether it writes to something
/// beside the cloud that it returns; `moves_points()`, whether points are elsewhere after it; and
/// `choose(cloud, kept)`, if it only chooses points: see `ChoosingStep`.
export struct pipeline_step {};

/// A value that can be assigned, also where an F, such as a lambda, cannot.
template <class F>
class assignable {
 public:
  assignable(F value) : value_{std::move(value)} {}  // NOLINT: a conversion on purpose
  assignable(const assignable&) = default;
  assignable(assignable&&) = default;
  assignable& operator=(const assignable& other) {
    F copy{*other};  // Which may throw, so it is made first.
    value_.emplace(std::move(copy));
    return *this;
  }
  assignable& operator=(assignable&& other) noexcept(std::is_nothrow_move_constructible_v<F>) {
    if (this != &other) value_.emplace(std::move(*other.value_));
    return *this;
  }
  ~assignable() = default;

  const F& operator*() const { return *value_; }

 private:
  std::optional<F> value_;  // Always there.
};

/// Parts of a cloud beside its points: `normals` and `colors`.
export struct cloud_parts {
  bool normals = false, colors = false;
};

/// How far around a point a step looks to decide what becomes of that point. A part of a cloud with
/// a margin of this width gives the same result there as the whole cloud.
export struct step_reach {
  double distance = 0;      ///< In the units of the points.
  index_t neighbors = 0;    ///< If not 0: it looks at this many nearest points, however far away.
  bool everything = false;  ///< Whether any point may depend on any other.

  /// The reach of two steps, one after the other. If both look at nearest points, nothing bounds
  /// it.
  friend step_reach operator+(const step_reach& a, const step_reach& b) {
    return {a.distance + b.distance, std::max(a.neighbors, b.neighbors),
            a.everything || b.everything || (a.neighbors > 0 && b.neighbors > 0)};
  }
  friend bool operator==(const step_reach&, const step_reach&) = default;
};

template <std::derived_from<pipeline_step> T>
inline constexpr bool composes_with_closures<T> = false;

/// Whether T is a `pipeline`.
export template <class T>
inline constexpr bool is_pipeline = false;
template <class T>
inline constexpr bool is_function_step = false;

/// Whether T has an `operator|` of its own for steps, as what is larger than a cloud has.
export template <class T>
inline constexpr bool takes_steps_itself = false;

/// A step that `|` can combine with any other step or function.
export template <class T>
concept PipelineStep = std::derived_from<std::remove_cvref_t<T>, pipeline_step>;

/// Whether C can be sent through all the steps.
template <class C, class... Steps>
inline constexpr bool goes_through = PointCloud<C>;
template <class C, class First, class... Rest>
inline constexpr bool goes_through<C, First, Rest...> = false;
template <class C, class First, class... Rest>
  requires StepFor<First, C>
inline constexpr bool goes_through<C, First, Rest...> =
    sizeof...(Rest) == 0 || goes_through<std::invoke_result_t<const First&, C>, Rest...>;

/// Throws `invalid_input` if a part that is needed is missing.
void expect_parts(const cloud_parts& needed, bool has_normals, bool has_colors);

/// Steps one after the other: the type of `a | b | c`, which is a step itself. Consecutive steps
/// that only choose points run in one pass, and the remaining points are copied once.
export template <class... Steps>
class pipeline : public pipeline_step {
 public:
  explicit pipeline(std::tuple<Steps...> steps) : steps_(std::move(steps)) {}

  /// The steps in their order.
  [[nodiscard]] const std::tuple<Steps...>& steps() const& [[clang::lifetimebound]] {
    return steps_;
  }
  [[nodiscard]] std::tuple<Steps...> steps() && { return std::move(steps_); }

  /// Sends the cloud through all steps. Throws what the steps throw, and, before any step runs,
  /// `invalid_input` if the cloud lacks a part that one of them needs and no earlier step gives.
  template <PointCloud C>
    requires goes_through<C, Steps...>
  decltype(auto) operator()(C&& cloud) const {
    if (!cloud.empty()) expect_parts(needs(), cloud.has_normals(), cloud.has_colors());
    return run<0>(std::forward<C>(cloud));
  }

  /// The names of the steps, joined by " | ".
  [[nodiscard]] std::string name() const;
  /// The parts that a step needs and no earlier step gives; of steps up to the first that says
  /// nothing of itself, such as a lambda.
  [[nodiscard]] cloud_parts needs() const;
  /// The parts that some step gives.
  [[nodiscard]] cloud_parts gives() const;
  /// Whether one of the steps does.
  [[nodiscard]] bool writes_outside() const {
    return std::apply([](const auto&... step) { return (writes_outside_of(step) || ...); }, steps_);
  }
  /// The sum of the reaches of the steps; only if all of them have one.
  [[nodiscard]] step_reach reach() const
    requires(requires(const Steps& step) { step.reach(); } && ...);
  /// Applies `choose` of all steps, in order; only if all of them only choose points.
  template <PointCloud C>
    requires(ChoosingStep<Steps, C> && ...)
  void choose(const C& cloud, chosen_points& kept) const {
    std::apply([&](const auto&... step) { (step.choose(cloud, kept), ...); }, steps_);
  }

 private:
  /// How many consecutive steps from `First` on only choose points.
  template <std::size_t First, class C>
  static constexpr std::size_t choosing() {
    if constexpr (First < sizeof...(Steps))
      if constexpr (ChoosingStep<std::tuple_element_t<First, std::tuple<Steps...>>, C>)
        return 1 + choosing<First + 1, C>();
    return 0;
  }

  template <std::size_t First, class C>
  decltype(auto) run(C&& cloud) const {
    constexpr std::size_t count = choosing<First, C>();
    if constexpr (count < 2 && First + 1 == sizeof...(Steps))
      return std::get<First>(steps_)(std::forward<C>(cloud));
    else if constexpr (count < 2)
      return run<First + 1>(std::get<First>(steps_)(std::forward<C>(cloud)));
    else if constexpr (First + count == sizeof...(Steps))
      return choose_at<First>(std::forward<C>(cloud), std::make_index_sequence<count>{});
    else
      return run<First + count>(
          choose_at<First>(std::forward<C>(cloud), std::make_index_sequence<count>{}));
  }
  template <std::size_t First, class C, std::size_t... I>
  auto choose_at(C&& cloud, std::index_sequence<I...>) const {
    return keep_chosen(std::forward<C>(cloud), std::get<First + I>(steps_)...);
  }

  std::tuple<Steps...> steps_;
};
template <class... Steps>
inline constexpr bool is_pipeline<pipeline<Steps...>> = true;

/// The name of a step, for reports: its member `name`, or "step" if it has none.
export template <class T>
[[nodiscard]] std::string name_of(const T& step) {
  if constexpr (is_pipeline<T>)
    return step.name();
  else if constexpr (is_function_step<T>)
    return name_of(step.function());
  else if constexpr (requires { std::string{step.name}; })
    return std::string{step.name};
  else
    return "step";
}
/// The parts of a cloud that a step needs; none if it does not say.
export template <class T>
[[nodiscard]] cloud_parts needs_of(const T& step) {
  if constexpr (requires { step.needs(); })
    return step.needs();
  else
    return {};
}
/// The parts that the result of a step always has; none if it does not say.
export template <class T>
[[nodiscard]] cloud_parts gives_of(const T& step) {
  if constexpr (requires { step.gives(); })
    return step.gives();
  else
    return {};
}
/// How far around a point a step looks; nothing if it does not say.
export template <class T>
[[nodiscard]] std::optional<step_reach> reach_of(const T& step) {
  if constexpr (requires { step.reach(); })
    return step.reach();
  else
    return std::nullopt;
}

/// Whether a step writes to something beside the cloud that it returns, such as a report or a file,
/// as far as it says: such a step must not be used by several threads at once.
export template <class T>
[[nodiscard]] bool writes_outside_of(const T& step) {
  if constexpr (requires { step.writes_outside(); })
    return step.writes_outside();
  else
    return false;
}

/// Whether a step says anything of itself. What another one needs or gives is not known.
template <class T>
inline constexpr bool describes_itself =
    requires(const T& step) { step.needs(); } || requires(const T& step) { step.gives(); } ||
    requires(const T& step) { step.reach(); } ||
    requires(const T& step) { std::string{step.name}; };

template <class... Steps>
std::string pipeline<Steps...>::name() const {
  std::string all;
  std::apply(
      [&](const auto&... step) { ((all += (all.empty() ? "" : " | ") + name_of(step)), ...); },
      steps_);
  return all;
}
template <class... Steps>
cloud_parts pipeline<Steps...>::needs() const {
  cloud_parts needed, given;
  bool is_known = true;
  const auto add = [&]<class T>(const T& step) {
    is_known = is_known && describes_itself<T>;
    if (!is_known) return;
    const auto now = needs_of(step), then = gives_of(step);
    needed.normals |= now.normals && !given.normals;
    needed.colors |= now.colors && !given.colors;
    given.normals |= then.normals;
    given.colors |= then.colors;
  };
  std::apply([&](const auto&... step) { (add(step), ...); }, steps_);
  return needed;
}
template <class... Steps>
cloud_parts pipeline<Steps...>::gives() const {
  cloud_parts given;
  const auto add = [&](const cloud_parts& parts) {
    given.normals |= parts.normals;
    given.colors |= parts.colors;
  };
  std::apply([&](const auto&... step) { (add(gives_of(step)), ...); }, steps_);
  return given;
}
template <class... Steps>
step_reach pipeline<Steps...>::reach() const
  requires(requires(const Steps& step) { step.reach(); } && ...)
{
  return std::apply([](const auto&... step) { return (step_reach{} + ... + step.reach()); },
                    steps_);
}

/// Turns a function into a step, where a pipeline begins with it or a function returns it:
/// `step{[](auto cloud) { …; return cloud; }}`. It can be assigned, even if the function is a
/// lambda, which cannot.
export template <class F>
class step : public pipeline_step {
 public:
  /// Keeps `function`; copies of the step have copies of it.
  explicit step(F function) : function_{std::move(function)} {}

  template <class C>
    requires StepFor<F, C>
  decltype(auto) operator()(C&& cloud) const {
    return std::invoke(*function_, std::forward<C>(cloud));
  }

  /// What is wrapped.
  [[nodiscard]] const F& function() const [[clang::lifetimebound]] { return *function_; }

  /// What the wrapped struct says of itself: `needs`, `gives`, `reach`, `moves_points`,
  /// `writes_outside`, `choose`.
  [[nodiscard]] cloud_parts needs() const
    requires requires(const F& f) { f.needs(); }
  {
    return function().needs();
  }
  [[nodiscard]] cloud_parts gives() const
    requires requires(const F& f) { f.gives(); }
  {
    return function().gives();
  }
  [[nodiscard]] step_reach reach() const
    requires requires(const F& f) { f.reach(); }
  {
    return function().reach();
  }
  [[nodiscard]] bool moves_points() const
    requires requires(const F& f) { f.moves_points(); }
  {
    return function().moves_points();
  }
  [[nodiscard]] bool writes_outside() const
    requires requires(const F& f) { f.writes_outside(); }
  {
    return function().writes_outside();
  }
  template <PointCloud C>
    requires ChoosingStep<F, C>
  void choose(const C& cloud, chosen_points& kept) const {
    function().choose(cloud, kept);
  }

 private:
  assignable<F> function_;
};
template <class F>
inline constexpr bool is_function_step<step<F>> = true;

/// A step that only chooses points, by `F::choose`: see `ChoosingStep`.
export template <class F>
struct choosing_step : F, pipeline_step {
  explicit choosing_step(F choice) : F(std::move(choice)) {}

  template <PointCloud C>
    requires ChoosingStep<F, C>
  std::remove_cvref_t<C> operator()(C&& cloud) const {
    return keep_chosen(std::forward<C>(cloud), *this);
  }
};

/// A step that calls `F::look(cloud)` and passes the cloud on unchanged.
export template <class F>
struct tap_step : F, pipeline_step {
  explicit tap_step(F tap) : F(std::move(tap)) {}

  template <PointCloud C>
    requires requires(const F& tap, const std::remove_cvref_t<C>& cloud) { tap.look(cloud); }
  C operator()(C&& cloud) const {
    this->look(std::as_const(cloud));
    return std::forward<C>(cloud);
  }
};

template <class T>
[[nodiscard]] auto as_steps(T step_or_line) {
  if constexpr (is_pipeline<T>)
    return std::move(step_or_line).steps();
  else if constexpr (PipelineStep<T>)
    return std::tuple<T>{std::move(step_or_line)};
  else
    return std::tuple<step<T>>{step{std::move(step_or_line)}};
}

/// Sends a cloud through a step, or any function of clouds.
export template <PointCloud C, class F>
  requires StepFor<F, C>
decltype(auto) operator|(C&& cloud, const F& function) {
  return std::invoke(function, std::forward<C>(cloud));
}

/// The step that applies `first`, then `second`. One of the two may be a function.
export template <class A, class B>
  requires(PipelineStep<A> || PipelineStep<B>) && (!PointCloud<A>) && (!PointCloud<B>) &&
          (!takes_steps_itself<A>) && (!std::ranges::range<A>) && (!std::ranges::range<B>) &&
          (!is_range_closure<A>) && (!is_range_closure<B>) &&
          (std::is_class_v<A> || std::is_pointer_v<A>) &&
          (std::is_class_v<B> || std::is_pointer_v<B>)
[[nodiscard]] auto operator|(A first, B second) {
  auto all = std::tuple_cat(as_steps(std::move(first)), as_steps(std::move(second)));
  return [&]<class... Steps>(std::tuple<Steps...>& steps) {
    return pipeline<Steps...>{std::move(steps)};
  }(all);
}

}  // namespace cilantro
