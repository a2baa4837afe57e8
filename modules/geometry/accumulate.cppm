// SPDX-License-Identifier: MIT
export module cilantro.geometry:accumulate;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :groups;
import :voxel_grid;

namespace cilantro {

/// What a cell gathers from its points: indices, sums, normals, colours, a histogram.
///
/// Semantics: each cell begins with a copy of the same empty accumulator; `add(i)` adds point i,
/// and `merge(later)` adds what another accumulator has gathered from later points. Each
/// accumulator is used by one thread at a time, but different ones by several threads at once.
/// Models: `index_accumulator`, `mean_accumulator`, `direction_accumulator`; any struct like them.
export template <class A>
concept GridAccumulator =
    std::copy_constructible<A> && requires(A& accumulator, const A& later, index_t i) {
      accumulator.add(i);
      accumulator.merge(later);
    };

/// How many members a thread gathers at a time. A constant, so that large cells are split in the
/// same places on every machine.
inline constexpr index_t accumulation_block = 4096;

/// Gathers the members of each group into a copy of `empty`, and returns these in the order of the
/// groups. In parallel, even within a group, and without locks; the same bits for any number of
/// threads.
export template <GridAccumulator A>
[[nodiscard]] std::vector<A> accumulate(const point_groups& groups, const A& empty,
                                        const execution& how = {}) {
  std::vector<A> gathered(static_cast<std::size_t>(groups.size()), empty);
  // If a group continues into a block, its members there are gathered separately, and merged
  // afterwards, in order.
  struct continuation {
    index_t group = -1;
    std::vector<A> gathered;
  };
  const index_t members = std::ssize(groups.members);
  std::vector<continuation> continued((members + accumulation_block - 1) / accumulation_block);
  parallel_blocks(members, accumulation_block, how, [&](index_t b, index_t begin, index_t end) {
    auto group = static_cast<index_t>(std::ranges::upper_bound(groups.offsets, begin) -
                                      groups.offsets.begin()) -
                 1;
    for (index_t i = begin; i < end; ++group) {
      A* into = &gathered[group];
      if (groups.offsets[group] < begin) {
        auto& rest = continued[b];
        rest.group = group;
        into = &rest.gathered.emplace_back(empty);
      }
      const index_t last = std::min(end, groups.offsets[static_cast<std::size_t>(group) + 1]);
      for (; i < last; ++i) into->add(index_t{groups.members[i]});
    }
  });
  for (const auto& rest : continued)
    if (rest.group >= 0) gathered[rest.group].merge(rest.gathered.front());
  return gathered;
}

/// As above, for the cells of a grid, in their order.
export template <Scalar S, int D, GridAccumulator A>
[[nodiscard]] std::vector<A> accumulate(const voxel_grid<S, D>& grid, const A& empty,
                                        const execution& how = {}) {
  return accumulate(grid.groups(), empty, how);
}

/// Gathers the indices of the points, ascending.
export struct index_accumulator {
  std::vector<index_t> indices;  ///< Ascending.
  void add(index_t i) { indices.push_back(i); }
  void merge(const index_accumulator& later) {
    indices.insert(indices.end(), later.indices.begin(), later.indices.end());
  }
};

/// Computes the mean of columns, such as points or colours, leaving out those that are not finite.
export template <Scalar S, int D>
class mean_accumulator {
 public:
  /// Views the columns, which must outlive it.
  template <BorrowedPoints P>
  explicit mean_accumulator(P&& columns)
      : columns_{as_points(std::forward<P>(columns))},
        sum_{point_vector<double, D>::Zero(columns_.dimension())} {}

  void add(index_t i) {
    if (!is_finite(columns_[i])) return;
    sum_ += columns_[i].template cast<double>();
    ++count_;
  }
  void merge(const mean_accumulator& later) {
    sum_ += later.sum_;
    count_ += later.count_;
  }
  /// The number of finite columns.
  [[nodiscard]] index_t count() const { return count_; }
  /// The mean; NaN if there was no finite column.
  [[nodiscard]] point_vector<S, D> mean() const {
    return (sum_ / double(count_)).template cast<S>();
  }

 private:
  points_view<S, D> columns_;
  point_vector<double, D> sum_;
  index_t count_ = 0;
};
export template <PointsSource P>
mean_accumulator(P&&) -> mean_accumulator<scalar_of<P>, dimension_of<P>>;

/// Computes the mean direction of unit vectors, leaving out those that are zero or not finite. Each
/// is flipped to the side of the first before it is added; in a cell of thousands, which is
/// gathered in parts, to the side of the first of its part.
export template <Scalar S, int D>
class direction_accumulator {
 public:
  /// Views the directions, which must outlive it.
  template <BorrowedPoints P>
  explicit direction_accumulator(P&& directions)
      : directions_{as_points(std::forward<P>(directions))},
        sum_{point_vector<double, D>::Zero(directions_.dimension())} {}

  void add(index_t i) {
    const auto direction = directions_[i];
    if (!is_finite(direction) || direction.isZero(0)) return;
    add(direction.template cast<double>(), i);
  }
  void merge(const direction_accumulator& later) {
    if (later.first_ >= 0) add(later.sum_, later.first_);
  }
  /// The mean at unit length; zero if no direction is known, or if they cancel.
  [[nodiscard]] point_vector<S, D> direction() const {
    const double length = sum_.norm();
    // Unit vectors that cancel leave only rounding errors, which have no meaningful direction.
    if (!(length > 1e-6)) return point_vector<S, D>::Zero(sum_.size());
    return (sum_ / length).template cast<S>();
  }

 private:
  void add(const point_vector<double, D>& some, index_t first) {
    if (first_ < 0) first_ = first;
    sum_ += directions_[first].dot(directions_[first_]) < 0 ? (-some).eval() : some;
  }

  points_view<S, D> directions_;
  point_vector<double, D> sum_;
  index_t first_ = -1;
};
export template <PointsSource P>
direction_accumulator(P&&) -> direction_accumulator<scalar_of<P>, dimension_of<P>>;

static_assert(GridAccumulator<index_accumulator>);
static_assert(GridAccumulator<mean_accumulator<float, 3>>);
static_assert(GridAccumulator<direction_accumulator<double, dynamic>>);

}  // namespace cilantro
