// SPDX-License-Identifier: MIT
//
// Which points of a cloud are kept, decided before any of them is copied.
module;
#include "core/closed_spaces.hpp"
export module cilantro.cloud:choice;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.geometry;
import :attribute;
import :point_cloud;

namespace cilantro {

/// Which points of a cloud are kept, and in which order: at first all of them, then fewer with each
/// step that chooses. Position k of the choice holds the point with index `choice[k]`.
export class chosen_points {
 public:
  /// All points of a cloud of `size`. Throws `invalid_input` for more than 2³¹ − 1.
  explicit chosen_points(index_t size) : size_{size} {
    expects(size <= std::numeric_limits<std::int32_t>::max(),
            "a cloud of more than 2^31 - 1 points cannot be chosen from");
  }

  [[nodiscard]] index_t size() const { return is_everything_ ? size_ : std::ssize(points_); }
  /// The index of the point at position `k`. Precondition: 0 <= k < size().
  [[nodiscard]] std::int32_t operator[](index_t k) const {
    return is_everything_ ? static_cast<std::int32_t>(k) : points_[k];
  }
  /// Whether all points are kept, in their order.
  [[nodiscard]] bool is_everything() const { return is_everything_; }
  /// The indices of all points that are kept, in their order.
  [[nodiscard]] index_list indices() const {
    if (!is_everything_) return points_;
    index_list all;
    all.reserve(size_);
    for (index_t i = 0; i < size_; ++i) all.push_back(static_cast<std::int32_t>(i));
    return all;
  }

  /// Keeps the points for which `wanted(k, index)` holds, in their order; k is the position,
  /// `index` the point.
  template <std::predicate<index_t, std::int32_t> F>
  void keep_if(F&& wanted) {
    index_list next;
    bool is_everything = is_everything_;
    for (index_t k = 0, before = size(); k < before; ++k) {
      const auto index = (*this)[k];
      if (!wanted(k, index)) {
        if (!is_everything) continue;
        // The first point that is dropped: those before it have not been recorded yet.
        is_everything = false;
        next.reserve(before);
        for (std::int32_t i = 0; i < index; ++i) next.push_back(i);
      } else if (!is_everything) {
        next.push_back(index);
      }
    }
    if (is_everything) return;
    points_ = std::move(next);
    is_everything_ = false;
  }
  /// Keeps the points at these positions, in the order of `places`, which may repeat. Precondition:
  /// 0 <= place < size().
  void keep(std::span<const std::int32_t> places) {
    // The same number of positions, each in its place: nothing changes.
    bool is_same = std::ssize(places) == size();
    for (index_t k = 0; is_same && k < size(); ++k) is_same = places[k] == k;
    if (is_same) return;
    index_list next;
    next.reserve(places.size());
    for (const auto k : places) next.push_back((*this)[k]);
    points_ = std::move(next);
    is_everything_ = false;
  }

 private:
  index_t size_;
  bool is_everything_ = true;
  index_list points_;
};

template <Scalar S, int D>
point_matrix<S, D> gather_columns(points_view<S, D> all, std::span<const std::int32_t> indices);
/// Moves the columns of ascending `indices` to the front.
template <Scalar S, int D>
void move_to_front(mutable_points_view<S, D> columns, std::span<const std::int32_t> indices);
/// Keeps the values of ascending `indices`.
void keep_in_place(attribute& all, std::span<const std::int32_t> indices);

/// The points of these indices, with all that belongs to them.
template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> gather(const point_cloud<S, D>& cloud,
                                       std::span<const std::int32_t> indices) {
  constexpr int C = closed_dimension<D>;
  point_cloud<S, D> selected;
  selected.points = gather_columns<S, C>(as_points(cloud.points), indices);
  if (cloud.has_normals())
    selected.normals = gather_columns<S, C>(as_points(cloud.normals), indices);
  if (cloud.has_colors())
    selected.colors = gather_columns<float, 3>(as_points(cloud.colors), indices);
  for (const auto& a : cloud.attributes) selected.attributes.push_back(select(a, indices));
  selected.comments = cloud.comments;
  selected.origin = cloud.origin;
  return selected;
}
/// As above, of a cloud that is no longer needed: in its own memory, if at least half of the points
/// stay, in their order.
template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> gather(point_cloud<S, D>&& cloud,
                                       std::span<const std::int32_t> indices) {
  const auto turns = [](std::int32_t i, std::int32_t j) { return i >= j; };
  if (std::ssize(indices) < cloud.size() / 2 ||
      std::ranges::adjacent_find(indices, turns) != indices.end())
    return gather(std::as_const(cloud), indices);
  const auto keep = [&]<Scalar T, int R>(auto& columns, points_view<T, R>) {
    move_to_front<T, R>(mutable_points_in(columns), indices);
    columns.conservativeResize(columns.rows(), std::ssize(indices));
  };
  constexpr int C = closed_dimension<D>;
  keep(cloud.points, points_view<S, C>{});
  if (cloud.has_normals()) keep(cloud.normals, points_view<S, C>{});
  if (cloud.has_colors()) keep(cloud.colors, points_view<float, 3>{});
  for (auto& a : cloud.attributes) keep_in_place(a, indices);
  cloud.width = cloud.height = 0;
  return std::move(cloud);
}
/// The points of the cloud that are kept, with all that belongs to them.
template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> gather(const point_cloud<S, D>& cloud, const chosen_points& kept) {
  if (kept.is_everything()) return cloud;
  return gather(cloud, std::span<const std::int32_t>{kept.indices()});
}
template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> gather(point_cloud<S, D>&& cloud, const chosen_points& kept) {
  if (kept.is_everything()) return std::move(cloud);
  return gather(std::move(cloud), std::span<const std::int32_t>{kept.indices()});
}

/// A step of a pipeline that only chooses points: `choose(cloud, kept)` reduces or reorders `kept`,
/// and does not change the cloud. Consecutive steps of this kind in a stored pipeline run in one
/// pass, and the remaining points are copied once.
export template <class T, class C>
concept ChoosingStep =
    requires(const T& step, const std::remove_cvref_t<C>& cloud, chosen_points& kept) {
      { step.choose(cloud, kept) } -> std::same_as<void>;
    };

template <class First, class... Rest>
[[nodiscard]] const char* name_of_first(const First& first, const Rest&...) {
  if constexpr (requires { static_cast<const char*>(first.name); })
    return first.name;
  else
    return "pipeline";
}

/// The points that remain after all of `steps`, applied one after the other, with all that belongs
/// to them.
template <PointCloud C, class... Steps>
[[nodiscard]] std::remove_cvref_t<C> keep_chosen(C&& cloud, const Steps&... steps) {
  expect_consistent(cloud, name_of_first(steps...));
  chosen_points kept{cloud.size()};
  (steps.choose(std::as_const(cloud), kept), ...);
  return gather(std::forward<C>(cloud), kept);
}

#define CILANTRO_COMPILED_ELSEWHERE(S, D)                                                       \
  extern template point_cloud<S, D> gather(const point_cloud<S, D>&,                            \
                                           std::span<const std::int32_t>);                      \
  extern template point_cloud<S, D> gather(point_cloud<S, D>&&, std::span<const std::int32_t>); \
  extern template point_cloud<S, D> gather(const point_cloud<S, D>&, const chosen_points&);     \
  extern template point_cloud<S, D> gather(point_cloud<S, D>&&, const chosen_points&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
