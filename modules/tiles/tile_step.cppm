// SPDX-License-Identifier: MIT
export module cilantro.tiles:tile_step;

import cilantro.standard;
import cilantro.core;
import cilantro.geometry;
import cilantro.cloud;

namespace cilantro {

/// A step that says how far around a point it looks to decide what becomes of that point: it has a
/// member `reach()`, as the steps of the library do. Only such a step runs on tiles, since only
/// then is it known how much of its neighbours a tile needs. It keeps points where they are in
/// their order, unless it is `voxel_downsample`. See `with_reach`.
export template <class T>
concept SaysReach = requires(const T& step) {
  { step.reach() } -> std::convertible_to<step_reach>;
};

/// A step of your own that says how far it looks: what `with_reach` returns.
export template <class F>
struct reaching_step : pipeline_step {
  static constexpr const char* name = "with_reach";
  step<F> function;    ///< What is called.
  step_reach reaches;  ///< What `reach()` says.

  reaching_step(F call, step_reach how_far) : function{std::move(call)}, reaches{how_far} {}
  [[nodiscard]] step_reach reach() const { return reaches; }
  template <class C>
    requires StepFor<F, C>
  decltype(auto) operator()(C&& cloud) const {
    return function(std::forward<C>(cloud));
  }
};

/// A function of clouds as a step that looks at most `distance` away from a point, in the units of
/// the points, to decide what becomes of it: `survey | with_reach(0.5, [](auto cloud) { … })`. 0
/// for a function that treats each point by itself. The distance is that in space: a function that
/// looks at all that is above or below, however far, says no distance that is enough. The function
/// must not depend on anything else, such as the number of points; must keep the order of the
/// points; and must not move them. It is called by several threads at once, and for some points
/// more than once. Throws `invalid_input` for a negative or infinite distance.
export template <class F>
[[nodiscard]] auto with_reach(double distance, F function) {
  expect_between(0, distance, std::numeric_limits<double>::max(), "with_reach: the distance");
  return reaching_step<F>{std::move(function), {.distance = distance}};
}

/// The cells of a grid, in world coordinates.
template <int D>
struct cell_layout_of {
  point_vector<double, D> edges, corner;
};

/// What a step does to the order of points.
template <int D>
struct step_order {
  bool is_known = false;
  /// Of a step that makes a point of each cell, in the order of the cells. Otherwise points keep
  /// their order, if it is known, and all that belongs to them.
  std::optional<cell_layout_of<D>> cells = {};
};

/// A rectangle of the first two coordinates, in world coordinates.
struct tile_area {
  std::array<double, 2> lower, upper;
};

/// What a step keeps that chooses points by their places in the order of the whole.
struct place_choice {
  std::uint64_t count = 0;  ///< How many points it keeps.
  /// The place among these of what was at a place; nothing for what is not kept.
  std::function<std::optional<std::uint64_t>(std::uint64_t)> place_of;
  double thinning = 1;  ///< Of how many points one is kept, wherever they are.
};
/// What `take`, `stride`, and a step that lists indices keep of so many points.
[[nodiscard]] place_choice choose_first(std::uint64_t size, index_t count);
[[nodiscard]] place_choice choose_every(std::uint64_t size, index_t n);
[[nodiscard]] place_choice choose_listed(std::uint64_t size, const std::string& name,
                                         const std::function<index_list(index_t)>& indices);

/// A step on tiles, whatever its type.
template <Scalar S, int D>
struct tile_step {
  std::string name;
  step_reach reach;
  bool moves_points = false, writes_outside = false;
  step_order<D> order = {};
  std::function<point_cloud<S, D>(point_cloud<S, D>&&)> apply = {};
  /// Of a step that keeps points by a number that each has, if that is at most a limit that all
  /// points together decide; otherwise empty, as `limit` is. Such a step has no `apply`.
  std::function<std::vector<double>(const point_cloud<S, D>&)> measure = {};
  std::function<double(const distance_statistics&)> limit = {};
  /// What a run that is resumed must have in common with the one before, beside name and reach.
  std::string about = {};
  /// Of a step that takes memory beside that of its points: how many bytes, for points of an area,
  /// or, without one, for points anywhere.
  std::function<std::uint64_t(const std::optional<tile_area>&)> more_memory = {};
  bool keeps_all = false;  ///< Whether it keeps all points, in their order.
  /// Of a step that chooses points by their places: what it keeps of so many, and, once it is
  /// decided, what it and those before it keep of the points of the files. Only then it has an
  /// `apply`.
  std::function<place_choice(std::uint64_t)> choice = {};
  std::shared_ptr<const place_choice> chosen = {};
};

/// A step that keeps points by a number that each has, if that is at most a limit that all points
/// together decide.
template <class T, class C>
concept MeasuringStep = requires(const T& step, const C& cloud, const distance_statistics& all) {
  { step.measure(cloud) } -> std::same_as<std::vector<double>>;
  { step.template limit<typename C::scalar>(all) } -> std::same_as<double>;
};

/// Whether a step says that it moves points.
template <class T>
[[nodiscard]] bool moves_points_of(const T& step) {
  if constexpr (requires { step.moves_points(); })
    return step.moves_points();
  else
    return false;
}

/// Whether points go through steps of a type in their order, with all that belongs to them.
template <class T>
inline constexpr bool keeps_points = false;
template <class E>
inline constexpr bool keeps_points<estimate_normals_step<E>> = true;
template <>
inline constexpr bool keeps_points<orient_to_viewpoint_step> = true;
template <AffineMap T>
inline constexpr bool keeps_points<transform_step<T>> = true;

template <Scalar S, int D, class T>
[[nodiscard]] step_order<D> order_of(const T& step) {
  if constexpr (std::same_as<T, voxel_downsample_step>) {
    point_vector<double, D> corner = point_vector<double, D>::Zero();
    if (step.options.origin)
      corner = step.options.origin->template as<double, D>(
          D, "voxel_grid: the origin must have the dimension of the points");
    return {true, cell_layout_of<D>{step.size.template edges<D>(D), corner}};
  } else {
    return {keeps_points<T> || ChoosingStep<T, point_cloud<S, D>>};
  }
}

template <class Step, class C>
inline constexpr bool keeps_type = false;
template <class Step, class C>
  requires StepFor<Step, C>
inline constexpr bool keeps_type<Step, C> =
    std::same_as<std::remove_cvref_t<std::invoke_result_t<const Step&, C>>, C>;

/// A step as it is applied to a tile.
template <class Step>
[[nodiscard]] auto for_tiles(const Step& step) {
  if constexpr (requires { step.on_tiles(); })
    return step.on_tiles();
  else
    return step;
}

/// The steps that choose points by their places in the order of the whole.
using take_step = decltype(take(index_t{}));
using stride_step = decltype(stride(index_t{}));
using random_sample_step = decltype(random_sample(index_t{}));
using uniform_sample_step = decltype(uniform_sample(index_t{}));
template <class T>
concept PlaceChoosing = std::same_as<T, take_step> || std::same_as<T, stride_step> ||
                        std::same_as<T, random_sample_step> || std::same_as<T, uniform_sample_step>;

/// What such a step keeps, and its parameters in words.
template <PlaceChoosing T>
[[nodiscard]] std::pair<std::function<place_choice(std::uint64_t)>, std::string> choice_of(
    const T& step) {
  if constexpr (std::same_as<T, take_step>)
    return {[n = step.count](std::uint64_t size) { return choose_first(size, n); },
            "of " + std::to_string(step.count)};
  else if constexpr (std::same_as<T, stride_step>)
    return {[n = step.n](std::uint64_t size) { return choose_every(size, n); },
            "of " + std::to_string(step.n)};
  else if constexpr (std::same_as<T, uniform_sample_step>)
    return {[n = step.count](std::uint64_t size) {
              return choose_listed(size, "uniform_sample",
                                   [n](index_t all) { return uniform_indices(all, n); });
            },
            "of " + std::to_string(step.count)};
  else
    return {[n = step.count, seed = step.options.seed](std::uint64_t size) {
              return choose_listed(size, "random_sample",
                                   [n, seed](index_t all) { return random_indices(all, n, seed); });
            },
            "of " + std::to_string(step.count) + " by " + std::to_string(step.options.seed)};
}

template <Scalar S, int D, class Step>
void add_tile_steps(std::vector<tile_step<S, D>>& steps, const Step& next) {
  using on_tiles = decltype(for_tiles(next));
  if constexpr (is_pipeline<Step>) {
    std::apply([&](const auto&... each) { (add_tile_steps(steps, each), ...); }, next.steps());
  } else if constexpr (MeasuringStep<on_tiles, point_cloud<S, D>>) {
    const auto step = for_tiles(next);
    steps.push_back(
        {name_of(next),
         step.reach(),
         false,
         writes_outside_of(next),
         {true},
         {},
         [step](const point_cloud<S, D>& cloud) { return step.measure(cloud); },
         [step](const distance_statistics& all) { return step.template limit<S>(all); }});
  } else if constexpr (PlaceChoosing<Step>) {
    auto [choice, about] = choice_of(next);
    tile_step<S, D> step{name_of(next), {}, false, writes_outside_of(next), {true}};
    step.about = std::move(about);
    step.choice = std::move(choice);
    steps.push_back(std::move(step));
  } else {
    static_assert(
        SaysReach<Step>,
        "a step on tiles must say how far around a point it looks: give it a member "
        "`step_reach reach() const`, or wrap a function in with_reach(distance, function)");
    static_assert(keeps_type<Step, point_cloud<S, D>>,
                  "a step on tiles must accept the clouds of the tiles and return the same type");
    if constexpr (SaysReach<Step> && keeps_type<Step, point_cloud<S, D>>)
      steps.push_back({name_of(next), next.reach(), moves_points_of(next), writes_outside_of(next),
                       order_of<S, D>(next), [step = for_tiles(next)](point_cloud<S, D>&& cloud) {
                         return step(std::move(cloud));
                       }});
    steps.back().keeps_all = keeps_points<Step>;
    if constexpr (requires { next.about(); }) steps.back().about = next.about();
    if constexpr (requires(const std::optional<tile_area>& area) { next.more_memory(area); })
      steps.back().more_memory = [next](const std::optional<tile_area>& area) {
        return next.more_memory(area);
      };
  }
}

}  // namespace cilantro
