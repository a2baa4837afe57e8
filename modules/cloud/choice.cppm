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
  /// All points of a cloud of `size`. Precondition: `size` is at most 2³¹ − 1.
  explicit chosen_points(index_t size) : size_{size} {}

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
template <Scalar S, int D>
point_cloud<S, D> gather(const point_cloud<S, D>& cloud, std::span<const std::int32_t> indices);
/// As above, where the cloud is no longer needed: uses its memory, if the points stay in their
/// order.
template <Scalar S, int D>
point_cloud<S, D> gather(point_cloud<S, D>&& cloud, std::span<const std::int32_t> indices);
/// The points of the cloud that are kept, with all that belongs to them.
template <PointCloud C>
[[nodiscard]] std::remove_cvref_t<C> gather(C&& cloud, const chosen_points& kept) {
  if (kept.is_everything()) return std::forward<C>(cloud);
  return gather(std::forward<C>(cloud), std::span<const std::int32_t>{kept.indices()});
}

/// A step of a pipeline that only chooses points: `choose(cloud, kept)` reduces or reorders `kept`,
/// and does not change the cloud. Consecutive steps of this kind in a stored pipeline run in one
/// pass, and the remaining points are copied once.
export template <class T, class C>
concept ChoosingStep =
    requires(const T& step, const std::remove_cvref_t<C>& cloud, chosen_points& kept) {
      { step.choose(cloud, kept) } -> std::same_as<void>;
    };

/// The points that remain after all of `steps`, applied one after the other, with all that belongs
/// to them.
template <PointCloud C, class... Steps>
[[nodiscard]] std::remove_cvref_t<C> keep_chosen(C&& cloud, const Steps&... steps) {
  expect_consistent(cloud, "pipeline");
  chosen_points kept{cloud.size()};
  (steps.choose(std::as_const(cloud), kept), ...);
  return gather(std::forward<C>(cloud), kept);
}

#define CILANTRO_COMPILED_ELSEWHERE(S, D)                                  \
  extern template point_cloud<S, D> gather(const point_cloud<S, D>&,       \
                                           std::span<const std::int32_t>); \
  extern template point_cloud<S, D> gather(point_cloud<S, D>&&, std::span<const std::int32_t>);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
