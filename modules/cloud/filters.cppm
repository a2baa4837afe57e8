// SPDX-License-Identifier: MIT
//
// Filters that keep some points of a cloud, with all that belongs to them: as functions of clouds,
// as steps, and some also for points alone.
module;
#include "core/closed_spaces.hpp"
export module cilantro.cloud:filters;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.geometry;
import :choice;
import :pipeline;
import :point_cloud;

namespace cilantro {

/// Chooses points: by a range of indices; by a mask, which has one truth value per point (bool, or
/// a byte such as in `dbscan_result::is_core`); or by a predicate of the index.
export template <class W>
concept PointChoice = IndexRange<W> || MaskRange<W> || std::predicate<W, index_t>;

/// For each point, whether it is chosen. Throws `invalid_input`, naming the function `who`, for an
/// index that is out of range, and for a mask of another size.
template <PointChoice W>
[[nodiscard]] std::vector<bool> mask_of(W&& which, index_t size, const char* who) {
  std::vector<bool> mask(size);
  if constexpr (std::predicate<W, index_t>) {
    for (index_t i = 0; i < size; ++i) mask[i] = which(i);
  } else if constexpr (MaskRange<W>) {
    index_t count = 0;
    for (const auto chosen : which) {
      if (count < size) mask[count] = static_cast<bool>(chosen);
      ++count;
    }
    expects(count == size, std::string{who} + ": the mask has " + std::to_string(count) +
                               " values, and there are " + std::to_string(size) + " points");
  } else {
    for (const auto i : which) mask[checked_index(i, size, who)] = true;
  }
  return mask;
}

/// Keeps the chosen points: for indices, in their order, which may repeat; otherwise in the order
/// of the points.
template <PointChoice W>
void choose_points(W&& which, chosen_points& kept) {
  if constexpr (std::predicate<W, index_t>) {
    kept.keep_if([&](index_t k, std::int32_t) { return bool(which(k)); });
  } else if constexpr (IndexRange<W>) {
    index_list places;
    for (const auto k : which) places.push_back(checked_index(k, kept.size(), "select"));
    kept.keep(places);
  } else {
    const auto mask = mask_of(which, kept.size(), "select");
    kept.keep_if([&](index_t k, std::int32_t) { return mask[k]; });
  }
}

/// Keeps the points that are not chosen, in order.
template <PointChoice W>
void choose_others(W&& which, chosen_points& kept) {
  const auto mask = mask_of(which, kept.size(), "exclude");
  kept.keep_if([&](index_t k, std::int32_t) { return !mask[k]; });
}

/// A region that answers for many points at once.
template <class R, class S>
concept RegionForMany =
    requires(const R& region, points_view<S, dynamic> points, const Eigen::VectorXd& origin,
             std::span<std::uint8_t> inside) { region.mark_inside(points, origin, inside); };

/// Keeps the finite points that are inside a region, or those that are outside.
template <Scalar S, int D, Region<D> R>
void choose_in_region(points_view<S, D> points, const point_vector<double, D>& origin,
                      const R& region, bool inside, chosen_points& kept) {
  if constexpr (requires { region.check(index_t{}); })
    if (!points.empty()) region.check(points.dimension());
  if constexpr (RegionForMany<R, S>) {
    if (kept.size() > points.size() / 2) {
      std::vector<std::uint8_t> in(points.size());
      region.mark_inside(points_view<S, dynamic>{points}, Eigen::VectorXd{origin}, std::span{in});
      kept.keep_if([&](index_t, std::int32_t i) {
        return (in[i] != 0) == inside && (inside || is_finite(points[i]));
      });
      return;
    }
  }
  kept.keep_if([&](index_t, std::int32_t i) {
    if (!is_finite(points[i])) return false;
    const point_vector<double, D> place = points[i].template cast<double>() + origin;
    return is_inside<D>(region, place) == inside;
  });
}

/// The points of a matrix that a choice has kept.
template <PointsSource P>
[[nodiscard]] auto gather_points(const P& points, const chosen_points& kept)
    -> point_matrix<scalar_of<P>, dimension_of<P>> {
  return gather_columns<scalar_of<P>, closed_dimension<dimension_of<P>>>(points_in(points),
                                                                         kept.indices());
}

/// The points of a matrix that are in a region, or that are not.
template <PointsSource P, class R>
[[nodiscard]] auto choose_from_points(const P& points, const R& region, bool inside) {
  const auto view = points_in(points);
  chosen_points kept{view.size()};
  choose_in_region<scalar_of<P>, dimension_of<P>>(view, origin_in(points), region, inside, kept);
  return gather_points(points, kept);
}

/// Where a filter writes the indices of the points that it has removed, ascending, counted in the
/// cloud that the filter was given. May be null.
export using removed_indices = index_list*;

/// Keeps the points at positions `left`, and writes the indices of the others to `removed`.
void keep_and_tell(std::span<const std::int32_t> left, removed_indices removed,
                   chosen_points& kept);

/// Calls `f` with a view of the points that are kept, in the dimension that the library is compiled
/// for.
template <Scalar S, int D, class F>
auto with_points_left(const point_cloud<S, D>& cloud, const chosen_points& kept, F&& f) {
  constexpr int C = closed_dimension<D>;
  if (kept.is_everything()) return f(closed_points(cloud));
  const point_matrix<S, C> left = gather_columns<S, C>(as_points(cloud.points), kept.indices());
  return f(as_points(left));
}

/// Keeps the points that are finite.
template <Scalar S, int D>
void choose_finite(points_view<S, D> points, chosen_points& kept);
template <Scalar S, int D>
void choose_finite(const point_cloud<S, D>& cloud, chosen_points& kept) {
  choose_finite<S, closed_dimension<D>>(as_points(cloud.points), kept);
}

struct invalid_points {
  static constexpr const char* name = "remove_invalid";
  static step_reach reach() { return {}; }
  template <Scalar S, int D>
  void choose(const point_cloud<S, D>& cloud, chosen_points& kept) const {
    choose_finite(cloud, kept);
  }
};

/// The cloud without the points that have a non-finite coordinate; order, and all that belongs to
/// the other points, are kept. A cloud without such points is returned as it is.
export template <PointCloud C>
[[nodiscard]] std::remove_cvref_t<C> remove_invalid(C&& cloud) {
  return keep_chosen(std::forward<C>(cloud), invalid_points{});
}
/// As above, for points alone.
export template <PointsSource P>
  requires(!PointCloud<P>)
[[nodiscard]] auto remove_invalid(const P& points) {
  chosen_points kept{points_in(points).size()};
  choose_finite<scalar_of<P>, closed_dimension<dimension_of<P>>>(points_in(points), kept);
  return gather_points(points, kept);
}
/// As above, as a step.
export [[nodiscard]] auto remove_invalid() {
  return choosing_step{invalid_points{}};
}

template <class Which>
struct points_meant {
  assignable<Which> which;

  static constexpr const char* name = "select";
  static step_reach reach() { return {.everything = true}; }
  template <PointCloud C>
  void choose(const C&, chosen_points& kept) const {
    choose_points(*which, kept);
  }
};

/// The chosen points, with all that belongs to them: for indices, in their order, which may repeat;
/// otherwise in the order of the cloud. Throws `invalid_input` for an index that is out of range,
/// and for a mask that does not have one value per point.
export template <PointCloud C, PointChoice W>
[[nodiscard]] std::remove_cvref_t<C> select(C&& cloud, W&& which) {
  expect_consistent(cloud, "select");
  chosen_points kept{cloud.size()};
  choose_points(which, kept);
  return gather(std::forward<C>(cloud), kept);
}
/// As above, for points alone.
export template <PointsSource P, PointChoice W>
  requires(!PointCloud<P>)
[[nodiscard]] auto select(const P& points, W&& which) {
  chosen_points kept{points_in(points).size()};
  choose_points(which, kept);
  return gather_points(points, kept);
}
/// As above, as a step. In a pipeline, indices count the points that earlier steps have kept.
export template <class Which>
  requires PointChoice<const Which&>
[[nodiscard]] auto select(Which which) {
  return choosing_step{points_meant<Which>{std::move(which)}};
}

template <class Which>
struct points_not_meant {
  assignable<Which> which;

  static constexpr const char* name = "exclude";
  static step_reach reach() { return {.everything = true}; }
  template <PointCloud C>
  void choose(const C&, chosen_points& kept) const {
    choose_others(*which, kept);
  }
};

/// All points but those that `select` would return, in the order of the cloud. Throws as `select`
/// does.
export template <PointCloud C, PointChoice W>
[[nodiscard]] std::remove_cvref_t<C> exclude(C&& cloud, W&& which) {
  expect_consistent(cloud, "exclude");
  chosen_points kept{cloud.size()};
  choose_others(which, kept);
  return gather(std::forward<C>(cloud), kept);
}
export template <PointsSource P, PointChoice W>
  requires(!PointCloud<P>)
[[nodiscard]] auto exclude(const P& points, W&& which) {
  chosen_points kept{points_in(points).size()};
  choose_others(which, kept);
  return gather_points(points, kept);
}
export template <class Which>
  requires PointChoice<const Which&>
[[nodiscard]] auto exclude(Which which) {
  return choosing_step{points_not_meant<Which>{std::move(which)}};
}

template <class R>
struct points_in_region {
  assignable<R> region;
  bool inside;

  const char* name = inside ? "crop" : "remove_inside";
  static step_reach reach() { return {}; }
  template <Scalar S, int D>
    requires Region<R, D>
  void choose(const point_cloud<S, D>& cloud, chosen_points& kept) const {
    choose_in_region<S, D>(as_points(cloud.points), cloud.full_origin(), *region, inside, kept);
  }
};

/// A `Region` for points of at least one dimension.
template <class R>
concept SomeRegion = Region<R, 3> || Region<R, dynamic> || Region<R, 2>;

/// The points inside a region, in order. The region is a `box`, a `ball`, `half_spaces`, a struct
/// with `contains(point)`, or a predicate of a point; the point is in double and in world
/// coordinates, whatever scalar and origin the cloud has. Points that are not finite are dropped.
/// Throws what `region.check` throws.
export template <PointCloud C, Region<std::remove_cvref_t<C>::static_dimension> R>
[[nodiscard]] std::remove_cvref_t<C> crop(C&& cloud, const R& region) {
  return keep_chosen(std::forward<C>(cloud), points_in_region<R>{region, true});
}
/// As above, for points alone.
export template <PointsSource P, Region<dimension_of<P>> R>
  requires(!PointCloud<P>)
[[nodiscard]] auto crop(const P& points, const R& region) {
  return choose_from_points(points, region, true);
}
/// As above, as a step.
export template <SomeRegion R>
[[nodiscard]] auto crop(R region) {
  return choosing_step{points_in_region<R>{std::move(region), true}};
}

/// The finite points outside a region, in order. See `crop`.
export template <PointCloud C, Region<std::remove_cvref_t<C>::static_dimension> R>
[[nodiscard]] std::remove_cvref_t<C> remove_inside(C&& cloud, const R& region) {
  return keep_chosen(std::forward<C>(cloud), points_in_region<R>{region, false});
}
export template <PointsSource P, Region<dimension_of<P>> R>
  requires(!PointCloud<P>)
[[nodiscard]] auto remove_inside(const P& points, const R& region) {
  return choose_from_points(points, region, false);
}
export template <SomeRegion R>
[[nodiscard]] auto remove_inside(R region) {
  return choosing_step{points_in_region<R>{std::move(region), false}};
}

struct first_points {
  index_t count;

  static constexpr const char* name = "take";
  static step_reach reach() { return {.everything = true}; }
  template <PointCloud C>
  void choose(const C&, chosen_points& kept) const {
    expect_from(0, double(count), "take: the count");
    kept.keep_if([&](index_t k, std::int32_t) { return k < count; });
  }
};
/// The first `count` points, or all if there are no more, with all that belongs to them. Throws
/// `invalid_input` for a negative count.
export template <PointCloud C>
[[nodiscard]] std::remove_cvref_t<C> take(C&& cloud, std::integral auto count) {
  return keep_chosen(std::forward<C>(cloud), first_points{static_cast<index_t>(count)});
}
/// The same as a step.
export [[nodiscard]] auto take(std::integral auto count) {
  return choosing_step{first_points{static_cast<index_t>(count)}};
}

struct every_nth_point {
  index_t n;

  static constexpr const char* name = "stride";
  static step_reach reach() { return {.everything = true}; }
  template <PointCloud C>
  void choose(const C&, chosen_points& kept) const {
    expect_from(1, double(n), "stride: n");
    kept.keep_if([&](index_t k, std::int32_t) { return k % n == 0; });
  }
};
/// The first of every `n` points, with all that belongs to them. Throws `invalid_input` for n < 1.
export template <PointCloud C>
[[nodiscard]] std::remove_cvref_t<C> stride(C&& cloud, std::integral auto n) {
  return keep_chosen(std::forward<C>(cloud), every_nth_point{static_cast<index_t>(n)});
}
/// The same as a step.
export [[nodiscard]] auto stride(std::integral auto n) {
  return choosing_step{every_nth_point{static_cast<index_t>(n)}};
}

/// How outliers are found in a part of a larger cloud, whose points beyond it are not known.
struct statistical_outliers_on_tiles {
  statistical_outlier_options options;

  [[nodiscard]] step_reach reach() const { return {.neighbors = options.neighbors}; }
  template <Scalar S, int D>
  [[nodiscard]] std::vector<double> measure(const point_cloud<S, D>& cloud) const {
    return mean_neighbor_distances(cloud.points, options.neighbors, {options.threads});
  }
  template <Scalar S>
  [[nodiscard]] double limit(const distance_statistics& all) const {
    return all.limit(options.deviations, double(std::numeric_limits<S>::epsilon()));
  }
};
struct statistical_outliers_of {
  statistical_outlier_options options;
  removed_indices removed;

  static constexpr const char* name = "remove_statistical_outliers";
  [[nodiscard]] statistical_outliers_on_tiles on_tiles() const { return {options}; }
  [[nodiscard]] bool writes_outside() const { return removed != nullptr; }
  static step_reach reach() { return {.everything = true}; }
  template <Scalar S, int D>
  void choose(const point_cloud<S, D>& cloud, chosen_points& kept) const {
    const auto found = with_points_left(
        cloud, kept, [&](const auto& points) { return statistical_outliers(points, options); });
    keep_and_tell(found.kept, removed, kept);
  }
};
/// The cloud without its statistical outliers, in order. See `statistical_outliers`.
export template <PointCloud C>
[[nodiscard]] std::remove_cvref_t<C> remove_statistical_outliers(
    C&& cloud, const statistical_outlier_options& options = {}, removed_indices removed = nullptr) {
  return keep_chosen(std::forward<C>(cloud), statistical_outliers_of{options, removed});
}
export [[nodiscard]] auto remove_statistical_outliers(statistical_outlier_options options = {},
                                                      removed_indices removed = nullptr) {
  return choosing_step{statistical_outliers_of{std::move(options), removed}};
}

struct radius_outliers_of {
  radius_outlier_options options;
  removed_indices removed;

  static constexpr const char* name = "remove_radius_outliers";
  [[nodiscard]] bool writes_outside() const { return removed != nullptr; }
  [[nodiscard]] step_reach reach() const { return {.distance = options.radius}; }
  template <Scalar S, int D>
  void choose(const point_cloud<S, D>& cloud, chosen_points& kept) const {
    const auto found = with_points_left(
        cloud, kept, [&](const auto& points) { return radius_outliers(points, options); });
    keep_and_tell(found.kept, removed, kept);
  }
};
/// The cloud without its radius outliers, in order. See `radius_outliers`.
export template <PointCloud C>
[[nodiscard]] std::remove_cvref_t<C> remove_radius_outliers(C&& cloud,
                                                            const radius_outlier_options& options,
                                                            removed_indices removed = nullptr) {
  return keep_chosen(std::forward<C>(cloud), radius_outliers_of{options, removed});
}
export [[nodiscard]] auto remove_radius_outliers(radius_outlier_options options,
                                                 removed_indices removed = nullptr) {
  return choosing_step{radius_outliers_of{std::move(options), removed}};
}

/// Options of `random_sample`.
export struct random_sample_options {
  std::uint64_t seed = 0;  ///< Another one draws other points.
};

struct random_points {
  index_t count;
  random_sample_options options;
  removed_indices removed;

  static constexpr const char* name = "random_sample";
  [[nodiscard]] bool writes_outside() const { return removed != nullptr; }
  static step_reach reach() { return {.everything = true}; }
  template <PointCloud C>
  void choose(const C&, chosen_points& kept) const {
    keep_and_tell(random_indices(kept.size(), count, options.seed), removed, kept);
  }
};
/// `count` random points of the cloud, in order; every set is equally likely. All points if there
/// are fewer.
export template <PointCloud C>
[[nodiscard]] std::remove_cvref_t<C> random_sample(C&& cloud, std::integral auto count,
                                                   const random_sample_options& options = {},
                                                   removed_indices removed = nullptr) {
  return keep_chosen(std::forward<C>(cloud),
                     random_points{static_cast<index_t>(count), options, removed});
}
export [[nodiscard]] auto random_sample(std::integral auto count,
                                        random_sample_options options = {},
                                        removed_indices removed = nullptr) {
  return choosing_step{random_points{static_cast<index_t>(count), options, removed}};
}

struct uniform_points {
  index_t count;
  removed_indices removed;

  static constexpr const char* name = "uniform_sample";
  [[nodiscard]] bool writes_outside() const { return removed != nullptr; }
  static step_reach reach() { return {.everything = true}; }
  template <PointCloud C>
  void choose(const C&, chosen_points& kept) const {
    keep_and_tell(uniform_indices(kept.size(), count), removed, kept);
  }
};
/// `count` points of the cloud at equal steps of the index. All points if there are fewer. See
/// `uniform_indices`.
export template <PointCloud C>
[[nodiscard]] std::remove_cvref_t<C> uniform_sample(C&& cloud, std::integral auto count,
                                                    removed_indices removed = nullptr) {
  return keep_chosen(std::forward<C>(cloud), uniform_points{static_cast<index_t>(count), removed});
}
export [[nodiscard]] auto uniform_sample(std::integral auto count,
                                         removed_indices removed = nullptr) {
  return choosing_step{uniform_points{static_cast<index_t>(count), removed}};
}

struct farthest_points {
  index_t count;
  farthest_point_options options;
  removed_indices removed;

  static constexpr const char* name = "farthest_point_sample";
  [[nodiscard]] bool writes_outside() const { return removed != nullptr; }
  static step_reach reach() { return {.everything = true}; }
  template <Scalar S, int D>
  void choose(const point_cloud<S, D>& cloud, chosen_points& kept) const {
    const auto picked = with_points_left(cloud, kept, [&](const auto& points) {
      return farthest_point_sample(points, count, options);
    });
    keep_and_tell(picked, removed, kept);
  }
};
/// `count` points of the cloud, each the farthest from all selected before it, in that order. See
/// `farthest_point_sample` for points.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> farthest_point_sample(const point_cloud<S, D>& cloud,
                                                      std::integral auto count,
                                                      const farthest_point_options& options = {},
                                                      removed_indices removed = nullptr) {
  return keep_chosen(cloud, farthest_points{static_cast<index_t>(count), options, removed});
}
export [[nodiscard]] auto farthest_point_sample(std::integral auto count,
                                                farthest_point_options options = {},
                                                removed_indices removed = nullptr) {
  return choosing_step{farthest_points{static_cast<index_t>(count), std::move(options), removed}};
}

#define CILANTRO_COMPILED_ELSEWHERE(S, D) \
  extern template void choose_finite<S, D>(const point_cloud<S, D>&, chosen_points&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
