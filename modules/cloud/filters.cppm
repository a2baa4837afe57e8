// SPDX-License-Identifier: MIT
//
// Fewer points of a cloud, with all that belongs to them: functions on clouds, the same as steps,
// and some of them on points alone.
export module cilantro.cloud:filters;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.geometry;
import :choice;
import :pipeline;
import :point_cloud;

namespace cilantro {

/// Which points are meant: those with some indices, those of a mask, which has one truth value per
/// point (bool, or a byte such as in `dbscan_result::is_core`), or those whose index satisfies a
/// predicate.
export template <class W>
concept PointChoice = IndexRange<W> || MaskRange<W> || std::predicate<W, index_t>;

/// For each point whether it is meant. Throws `invalid_input`, naming the function `who`, for an
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

/// Leaves the chosen points: in the order of the indices and as often as one is named, otherwise in
/// their own order.
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

/// Leaves all others.
template <PointChoice W>
void choose_others(W&& which, chosen_points& kept) {
  const auto mask = mask_of(which, kept.size(), "exclude");
  kept.keep_if([&](index_t k, std::int32_t) { return !mask[k]; });
}

/// Leaves the finite points that are in a region, or that are not.
template <Scalar S, int D, Region<D> R>
void choose_in_region(points_view<S, D> points, const point_vector<double, D>& origin,
                      const R& region, bool inside, chosen_points& kept) {
  if constexpr (requires { region.check(index_t{}); }) region.check(points.dimension());
  kept.keep_if([&](index_t, std::int32_t i) {
    if (!is_finite(points[i])) return false;
    const point_vector<double, D> place = points[i].template cast<double>() + origin;
    return is_inside<D>(region, place) == inside;
  });
}

/// The points of a matrix that a choice has left.
template <PointsSource P>
[[nodiscard]] auto gather_points(const P& points, const chosen_points& kept)
    -> point_matrix<scalar_of<P>, dimension_of<P>> {
  return gather_columns<scalar_of<P>, closed_dimension<dimension_of<P>>>(points_in(points),
                                                                         kept.indices());
}

/// Where a filter tells which points of the cloud it was given it has removed: their indices,
/// ascending. May be null.
export using removed_indices = index_list*;

/// Leaves the places `left`, and tells the others.
void keep_and_tell(std::span<const std::int32_t> left, removed_indices removed,
                   chosen_points& kept);

/// `f(points)` of the points that are left, as a view in the dimension that is compiled.
template <Scalar S, int D, class F>
auto with_points_left(const point_cloud<S, D>& cloud, const chosen_points& kept, F&& f) {
  constexpr int C = closed_dimension<D>;
  if (kept.is_everything()) return f(closed_points(cloud));
  const point_matrix<S, C> left = gather_columns<S, C>(as_points(cloud.points), kept.indices());
  return f(as_points(left));
}

struct invalid_points {
  static constexpr const char* name = "remove_invalid";
  static step_reach reach() { return {}; }
  template <Scalar S, int D>
  void choose(const point_cloud<S, D>& cloud, chosen_points& kept) const {
    const auto points = closed_points(cloud);
    kept.keep_if([&](index_t, std::int32_t i) { return is_finite(points[i]); });
  }
};

/// The cloud without the points that have a non-finite coordinate, in order, with all that belongs
/// to the others. A cloud without such points is handed on as it is.
export template <PointCloud C>
[[nodiscard]] std::remove_cvref_t<C> remove_invalid(C&& cloud) {
  return keep_chosen(std::forward<C>(cloud), invalid_points{});
}
/// The same of points alone.
export template <PointsSource P>
  requires(!PointCloud<P>)
[[nodiscard]] auto remove_invalid(const P& points) {
  const auto view = points_in(points);
  chosen_points kept{view.size()};
  kept.keep_if([&](index_t, std::int32_t i) { return is_finite(view[i]); });
  return gather_points(points, kept);
}
/// The same as a step.
export [[nodiscard]] inline auto remove_invalid() {
  return choosing_step{invalid_points{}};
}

template <class Which>
struct points_meant {
  Which which;

  static constexpr const char* name = "select";
  static step_reach reach() { return {.everything = true}; }
  template <PointCloud C>
  void choose(const C&, chosen_points& kept) const {
    choose_points(which, kept);
  }
};

/// The chosen points, with all that belongs to them: in the order of the indices and as often as
/// one is named, otherwise in the order of the cloud. Throws `invalid_input` for an index that is
/// out of range, and for a mask that has not one value per point.
export template <PointCloud C, PointChoice W>
[[nodiscard]] std::remove_cvref_t<C> select(C&& cloud, W&& which) {
  expect_consistent(cloud, "select");
  chosen_points kept{cloud.size()};
  choose_points(which, kept);
  return gather(std::forward<C>(cloud), kept);
}
/// The same of points alone.
export template <PointsSource P, PointChoice W>
  requires(!PointCloud<P>)
[[nodiscard]] auto select(const P& points, W&& which) {
  chosen_points kept{points_in(points).size()};
  choose_points(which, kept);
  return gather_points(points, kept);
}
/// The same as a step. In a line of steps, indices count what the steps before have left.
export template <class Which>
  requires PointChoice<const Which&>
[[nodiscard]] auto select(Which which) {
  return choosing_step{points_meant<Which>{std::move(which)}};
}

template <class Which>
struct points_not_meant {
  Which which;

  static constexpr const char* name = "exclude";
  static step_reach reach() { return {.everything = true}; }
  template <PointCloud C>
  void choose(const C&, chosen_points& kept) const {
    choose_others(which, kept);
  }
};

/// All other points than `select` gives, in the order of the cloud. Throws as it does.
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
  R region;
  bool inside;

  const char* name = inside ? "crop" : "remove_inside";
  static step_reach reach() { return {}; }
  template <Scalar S, int D>
    requires Region<R, D>
  void choose(const point_cloud<S, D>& cloud, chosen_points& kept) const {
    choose_in_region<S, D>(as_points(cloud.points), cloud.full_origin(), region, inside, kept);
  }
};

/// A region for points of some dimension: see `Region`.
template <class R>
concept SomeRegion = Region<R, 2> || Region<R, 3> || Region<R, dynamic>;

/// The points in a region, in order: a `box`, a `ball`, `half_spaces`, a struct with
/// `contains(point)`, or a predicate of a point, which is in double and in the world, whatever
/// scalar and origin the cloud has. Points that are not finite are in none. Throws what
/// `region.check` does.
export template <Scalar S, int D, Region<D> R>
[[nodiscard]] point_cloud<S, D> crop(const point_cloud<S, D>& cloud, const R& region) {
  return keep_chosen(cloud, points_in_region<R>{region, true});
}
/// The same of points alone.
export template <PointsSource P, Region<dimension_of<P>> R>
  requires(!PointCloud<P>)
[[nodiscard]] auto crop(const P& points, const R& region) {
  const auto view = points_in(points);
  chosen_points kept{view.size()};
  choose_in_region<scalar_of<P>, dimension_of<P>>(view, origin_in(points), region, true, kept);
  return gather_points(points, kept);
}
/// The same as a step.
export template <SomeRegion R>
[[nodiscard]] auto crop(R region) {
  return choosing_step{points_in_region<R>{std::move(region), true}};
}

/// The finite points that `crop` would not keep, in order.
export template <Scalar S, int D, Region<D> R>
[[nodiscard]] point_cloud<S, D> remove_inside(const point_cloud<S, D>& cloud, const R& region) {
  return keep_chosen(cloud, points_in_region<R>{region, false});
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
/// The step that keeps the first `count` points, or all if there are no more.
export [[nodiscard]] inline auto take(index_t count) {
  return choosing_step{first_points{count}};
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
/// The step that keeps the first of every `n` points.
export [[nodiscard]] inline auto stride(index_t n) {
  return choosing_step{every_nth_point{n}};
}

struct statistical_outliers_of {
  statistical_outlier_options options;
  removed_indices removed;

  static constexpr const char* name = "remove_statistical_outliers";
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
export [[nodiscard]] inline auto remove_statistical_outliers(
    statistical_outlier_options options = {}, removed_indices removed = nullptr) {
  return choosing_step{statistical_outliers_of{std::move(options), removed}};
}

struct radius_outliers_of {
  radius_outlier_options options;
  removed_indices removed;

  static constexpr const char* name = "remove_radius_outliers";
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
export [[nodiscard]] inline auto remove_radius_outliers(radius_outlier_options options,
                                                        removed_indices removed = nullptr) {
  return choosing_step{radius_outliers_of{std::move(options), removed}};
}

struct random_points {
  index_t count;
  std::uint64_t seed;
  removed_indices removed;

  static constexpr const char* name = "random_sample";
  static step_reach reach() { return {.everything = true}; }
  template <PointCloud C>
  void choose(const C&, chosen_points& kept) const {
    keep_and_tell(random_indices(kept.size(), count, seed), removed, kept);
  }
};
/// `count` random points of the cloud, in order, each set equally likely; all if there are no more.
export template <PointCloud C>
[[nodiscard]] std::remove_cvref_t<C> random_sample(C&& cloud, index_t count, std::uint64_t seed = 0,
                                                   removed_indices removed = nullptr) {
  return keep_chosen(std::forward<C>(cloud), random_points{count, seed, removed});
}
export [[nodiscard]] inline auto random_sample(index_t count, std::uint64_t seed = 0,
                                               removed_indices removed = nullptr) {
  return choosing_step{random_points{count, seed, removed}};
}

struct uniform_points {
  index_t count;
  removed_indices removed;

  static constexpr const char* name = "uniform_sample";
  static step_reach reach() { return {.everything = true}; }
  template <PointCloud C>
  void choose(const C&, chosen_points& kept) const {
    keep_and_tell(uniform_indices(kept.size(), count), removed, kept);
  }
};
/// `count` points of the cloud at equal steps of the index; all if there are no more.
export template <PointCloud C>
[[nodiscard]] std::remove_cvref_t<C> uniform_sample(C&& cloud, index_t count,
                                                    removed_indices removed = nullptr) {
  return keep_chosen(std::forward<C>(cloud), uniform_points{count, removed});
}
export [[nodiscard]] inline auto uniform_sample(index_t count, removed_indices removed = nullptr) {
  return choosing_step{uniform_points{count, removed}};
}

struct farthest_points {
  index_t count;
  farthest_point_options options;
  removed_indices removed;

  static constexpr const char* name = "farthest_point_sample";
  static step_reach reach() { return {.everything = true}; }
  template <Scalar S, int D>
  void choose(const point_cloud<S, D>& cloud, chosen_points& kept) const {
    const auto picked = with_points_left(cloud, kept, [&](const auto& points) {
      return farthest_point_sample(points, count, options);
    });
    keep_and_tell(picked, removed, kept);
  }
};
/// `count` points of the cloud, each the farthest from all before it, in that order.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> farthest_point_sample(const point_cloud<S, D>& cloud, index_t count,
                                                      const farthest_point_options& options = {},
                                                      removed_indices removed = nullptr) {
  return keep_chosen(cloud, farthest_points{count, options, removed});
}
export [[nodiscard]] inline auto farthest_point_sample(index_t count,
                                                       farthest_point_options options = {},
                                                       removed_indices removed = nullptr) {
  return choosing_step{farthest_points{count, std::move(options), removed}};
}

}  // namespace cilantro
