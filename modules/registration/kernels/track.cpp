// SPDX-License-Identifier: MIT
#include "registration/kernels/track.hpp"

#include "search/kernels/block_walk.hpp"
#include "search/kernels/candidates.hpp"

namespace cilantro::detail::CILANTRO_VECTOR_TARGET {
namespace {

template <class S>
using all = vec<S, width>;
using all_indices = vec<std::int32_t, width>;

/// Whole lanes of ones where bit i is set, as a comparison gives them.
template <class S>
CILANTRO_ALWAYS_INLINE auto lanes_of(unsigned which) {
  all<S> v;
  for (int i = 0; i < width; ++i) v[i] = S(which >> i & 1);
  return v > all<S>(0);
}

template <class S>
CILANTRO_ALWAYS_INLINE S smallest_lane(all<S> v) {
  return -largest_lane<S>(-v);
}

template <class S, int D>
CILANTRO_ALWAYS_INLINE unsigned finite_lanes(const S (&places)[D][width]) {
  unsigned finite = 0xffff;
  for (int d = 0; d < D; ++d) {
    const auto v = load<all<S>>(places[d]);
    finite &= bits(v - v == 0);
  }
  return finite;
}

/// The nearest and the second nearest point of each query, which is a lane: points are compared
/// with all queries at once, and both are kept by comparisons and selections alone.
template <class S, int D>
class two_nearest {
 public:
  two_nearest(const block_tree<S>& tree, const query_block<S, D>& queries, all<S> limits)
      : tree_{tree}, queries_{queries}, first_{limits}, second_{limits}, nearest_(no_index) {
    update();
  }
  [[nodiscard]] CILANTRO_ALWAYS_INLINE bool admits(S bound, const S* box) const {
    return bound < farthest_second_ ||
           (bound <= farthest_first_ && smallest_index(box) < last_index_);
  }
  CILANTRO_ALWAYS_INLINE void visit(std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t b = begin; b < end; ++b) scan(b);
  }
  [[nodiscard]] all<S> first() const { return first_; }
  [[nodiscard]] all<S> second() const { return second_; }
  [[nodiscard]] all_indices nearest() const { return nearest_; }

 private:
  void scan(std::ptrdiff_t b) {
    const S* box = tree_.boxes + 8 * b;
    const all<S> bounds = queries_.bounds_to(box);
    if (bits((bounds < second_) | (bounds <= first_)) == 0) return;
    const S* const block = tree_.coordinates + b * D * width;
    const std::int32_t* const indices = tree_.indices + b * width;
    for (int i = 0; i < width && indices[i] >= 0; ++i) {
      all<S> difference[D];
      for (int d = 0; d < D; ++d)
        difference[d] = load<all<S>>(queries_.at[d]) - all<S>(block[d * width + i]);
      const all<S> sums = sum_of_squares(difference);
      const all_indices index = indices[i];
      const auto comes_first = (sums < first_) | ((sums == first_) & as_wide(index < nearest_));
      second_ = smaller(second_, larger(sums, first_));
      first_ = smaller(sums, first_);
      nearest_ = as_narrow(comes_first) ? index : nearest_;
    }
    update();
  }
  void update() {
    farthest_first_ = largest_lane<S>(first_);
    farthest_second_ = largest_lane<S>(second_);
    last_index_ = largest_lane<std::int32_t>(nearest_);
  }
  static CILANTRO_ALWAYS_INLINE auto as_wide(all_indices comparison) {
    return convert<decltype(all<S>{} < all<S>{})>(comparison);
  }
  static CILANTRO_ALWAYS_INLINE auto as_narrow(decltype(all<S>{} < all<S>{}) comparison) {
    return convert<all_indices>(comparison);
  }

  const block_tree<S>& tree_;
  const query_block<S, D>& queries_;
  all<S> first_, second_;
  all_indices nearest_;
  S farthest_first_ = 0, farthest_second_ = 0;
  std::int32_t last_index_ = 0;
};

/// Why a query need not be searched for again: let it have moved by m since it was, when every
/// point but its nearest one was at least g away. By the triangle inequality all those are at least
/// g − m away now; so if the nearest is at d < g − m, it still is the nearest, and the only one. If
/// there was none at all within g, there is none within g − m. Each of the three numbers is rounded
/// by less than the slack.
///
/// Where it must be searched for, the second nearest is at most g + m away, which limits the
/// search.
template <class S, int D>
void track(const track_search<S>& search, const track_block<S>& block) {
  alignas(64) S moved[D][width];
  all<S> from_origin[D];
  for (int d = 0; d < D; ++d)
    from_origin[d] = load<all<S>>(block.queries + d * width) - search.origin[d];
  for (int r = 0; r < D; ++r) {
    all<S> sum = from_origin[0] * search.linear[r];
    for (int c = 1; c < D; ++c) sum += from_origin[c] * search.linear[c * D + r];
    store(moved[r], sum + search.translation[r]);
  }

  if (!search.is_known) {
    store(block.others, all<S>(-1));
    store(block.nearest, all_indices(-1));
  }
  // A map may send a point beyond all numbers; it has no neighbour there.
  const unsigned strays = block.wanted & ~finite_lanes<S, D>(moved);
  for (int i = 0; i < width; ++i)
    if (strays >> i & 1) {
      block.nearest[i] = -1;
      block.others[i] = -1;
    }
  unsigned needed = block.wanted & ~strays;
  all<S> limits = search.reach, distances = search.reach;
  if (search.is_known) {
    all<S> way[D], gap[D];
    const auto nearest = load<all_indices>(block.nearest);
    for (int d = 0; d < D; ++d) {
      all<S> partner;
      for (int i = 0; i < width; ++i)
        partner[i] = nearest[i] >= 0 ? search.points[nearest[i] * search.stride + d] : S(0);
      way[d] = load<all<S>>(moved[d]) - load<all<S>>(block.places + d * width);
      gap[d] = load<all<S>>(moved[d]) - partner;
    }
    const all<S> m = __builtin_elementwise_sqrt(sum_of_squares(way));
    const all<S> others = load<all<S>>(block.others);
    const all<S> apart = __builtin_elementwise_sqrt(sum_of_squares(gap));
    distances =
        convert<decltype(others < others)>(nearest >= 0) ? apart : all<S>(search.max_distance);
    const unsigned holds =
        bits((others >= 0) & ((distances + m) * (1 + search.slack) < others * (1 - search.slack)));
    needed &= ~holds;
    const all<S> second = (others + m) * (1 + search.slack);
    limits = ((others >= 0) & (second < limits)) ? second : limits;
  }
  if (needed != 0) {
    const auto is_needed = lanes_of<S>(needed);
    vec<S, 4> low = S(0), high = S(0);
    for (int d = 0; d < D; ++d) {
      const auto v = load<all<S>>(moved[d]);
      low[d] = smallest_lane<S>(is_needed ? v : all<S>(infinity));
      high[d] = largest_lane<S>(is_needed ? v : all<S>(-infinity));
    }
    const query_block<S, D> queries{moved[0], low, high};
    two_nearest<S, D> reach{search.tree, queries, is_needed ? limits * limits : all<S>(-1)};
    walk(search.tree, queries, reach);

    const all<S> found = __builtin_elementwise_sqrt(reach.first());
    const all<S> beyond = __builtin_elementwise_sqrt(reach.second());
    distances = is_needed ? found : distances;
    for (int d = 0; d < D; ++d)
      store(block.places + d * width,
            is_needed ? load<all<S>>(moved[d]) : load<all<S>>(block.places + d * width));
    store(block.others, is_needed ? beyond : load<all<S>>(block.others));
    for (int i = 0; i < width; ++i)
      if (needed >> i & 1)
        block.nearest[i] = reach.nearest()[i] == no_index ? -1 : reach.nearest()[i];
  }
  store(block.distances, distances);
}

}  // namespace
}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET

namespace cilantro::detail {

using namespace CILANTRO_VECTOR_TARGET;

template <kernel_target V, class S, int D>
track_kernel<S>* track_in() {
  return track<S, D>;
}
template track_kernel<float>* track_in<this_target, float, 2>();
template track_kernel<float>* track_in<this_target, float, 3>();
template track_kernel<double>* track_in<this_target, double, 2>();
template track_kernel<double>* track_in<this_target, double, 3>();

}  // namespace cilantro::detail
