// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "core/closed_spaces.hpp"
module cilantro.registration;

namespace cilantro {
namespace {

constexpr index_t block_size = 512;

/// Finds for each query, at `place(q)`, the nearest of `points`, which are those of `tree`; unless
/// what is known from an earlier call tells that nothing can have changed.
///
/// Why that is exact: let a query have moved by m since it was searched for, when every point but
/// its nearest one was at least g away. By the triangle inequality all those are at least g − m
/// away now; so if the nearest is at d < g − m, it still is the nearest, and the only one. If there
/// was none at all within g, there is none within g − m. Each of the three numbers is rounded by
/// less than the slack.
template <Scalar S, int D, class Place>
void track(const kd_tree<S, D>& tree, points_view<S, D> points, index_t queries, Place place,
           S max_distance, tracked_queries<S>& known, std::span<const char> is_wanted,
           int threads) {
  const index_t dimension = points.dimension();
  const auto n = static_cast<std::size_t>(queries);
  known.places.resize(n * static_cast<std::size_t>(dimension));
  known.nearest.resize(n);
  known.others.resize(n);
  known.distances.resize(n);
  // A little farther than asked, so that also queries without a partner may move.
  const S reach = max_distance * S(1.5);
  const S slack = S(16 + 2 * dimension) * std::numeric_limits<S>::epsilon();

  parallel_blocks(
      queries, block_size, {.threads = threads}, [&](index_t, index_t begin, index_t end) {
        for (index_t q = begin; q < end; ++q) {
          const auto at = static_cast<std::size_t>(q);
          if (!is_wanted.empty() && !is_wanted[at]) {
            // What was known of it stays true; before the first search nothing is.
            if (!known.is_known) known.others[at] = -1;
            continue;
          }
          const point_vector<S, D> p = place(q);
          Eigen::Map<point_vector<S, D>> searched{known.places.data() + q * dimension, dimension};
          if (known.is_known && known.others[at] >= 0) {
            const S moved = (p - searched).norm();
            const std::int32_t nearest = known.nearest[at];
            const S distance = nearest >= 0 ? S((p - points[nearest]).norm()) : max_distance;
            if ((distance + moved) * (1 + slack) < known.others[at] * (1 - slack)) {
              known.distances[at] = distance;
              continue;
            }
          }
          const auto found = tree.nearest_two(p, reach);
          searched = p;
          known.nearest[at] = static_cast<std::int32_t>(found[0].index);
          known.others[at] = found[1].index >= 0 ? found[1].distance : reach;
          known.distances[at] =
              found[0].index >= 0 ? S((p - points[found[0].index]).norm()) : reach;
        }
      });
  known.is_known = true;
}

}  // namespace

template <Scalar S, int D>
nearest_neighbor_engine<S, D>::nearest_neighbor_engine(points_view<S, D> target,
                                                       points_view<S, D> source,
                                                       const correspondence_options& options,
                                                       const task_monitor& monitor)
    : target_{target}, source_{source}, options_{options} {
  expect_valid(options);
  expects(target.empty() || source.empty() || target.dimension() == source.dimension(),
          "nearest_neighbor_searcher: target and source must have the same dimension");
  if (target.empty() || source.empty()) return;
  const kd_tree_options how{.threads = options.threads, .monitor = monitor};
  if (options.reciprocal || options.direction != search_direction::target_to_source)
    target_tree_.emplace(target, how);
  if (options.reciprocal || options.direction != search_direction::source_to_target)
    source_tree_.emplace(source, how);
}

template <Scalar S, int D>
void nearest_neighbor_engine<S, D>::find_forward(const map_parts<S, D>& transform,
                                                 tracked_queries<S>& tracked) const {
  track<S, D>(
      *target_tree_, target_, source_.size(), [&](index_t s) { return transform(source_[s]); },
      S(options_.max_distance), tracked, {}, options_.threads);
}

template <Scalar S, int D>
void nearest_neighbor_engine<S, D>::find_backward(const map_parts<S, D>& transform,
                                                  tracked_queries<S>& tracked,
                                                  std::span<const char> is_wanted) const {
  const S limit = static_cast<S>(options_.max_distance);
  if (transform.is_rigid) {
    // Distances are the same on the other side, where the tree is.
    const Eigen::Matrix<S, D, D> back = transform.linear.transpose();
    return track<S, D>(
        *source_tree_, source_, target_.size(),
        [&](index_t t) { return point_vector<S, D>{back * (target_[t] - transform.translation)}; },
        // Rounding on that side must not lose what is just within the limit.
        limit * S(1.001), tracked, is_wanted, options_.threads);
  }
  point_matrix<S, D> moved(source_.dimension(), source_.size());
  for (index_t s = 0; s < source_.size(); ++s) moved.col(s) = transform(source_[s]);
  tracked.is_known = false;
  const kd_tree<S, D> tree{moved, {.threads = options_.threads}};
  track<S, D>(
      tree, points_view<S, D>{points_in(moved)}, target_.size(),
      [&](index_t t) { return point_vector<S, D>{target_[t]}; }, limit, tracked, is_wanted,
      options_.threads);
}

template <Scalar S, int D>
void nearest_neighbor_engine<S, D>::find(const map_parts<S, D>& transform,
                                         nearest_neighbor_memory<S>& memory,
                                         correspondences<S>& out) const {
  out.clear();
  if (target_.empty() || source_.empty()) return;
  expects(transform.translation.size() == target_.dimension(),
          "nearest_neighbor_searcher: transform and points must have the same dimension");
  const S limit = static_cast<S>(options_.max_distance);
  const auto pair_of = [&](std::int32_t t, std::int32_t s) {
    const S distance = (transform(source_[s]) - target_[t]).norm();
    if (distance <= limit) out.push_back({t, s, distance});
  };
  const auto partner_of = [](const tracked_queries<S>& found, index_t i) {
    return found.nearest[static_cast<std::size_t>(i)];
  };

  if (options_.reciprocal) {
    find_forward(transform, memory.sources);
    memory.is_wanted.assign(static_cast<std::size_t>(target_.size()), 0);
    for (const std::int32_t t : memory.sources.nearest)
      if (t >= 0) memory.is_wanted[static_cast<std::size_t>(t)] = 1;
    find_backward(transform, memory.targets, memory.is_wanted);
    for (std::int32_t s = 0; s < source_.size(); ++s)
      if (const auto t = partner_of(memory.sources, s);
          t >= 0 && partner_of(memory.targets, t) == s)
        pair_of(t, s);
    return select_correspondences(out, options_);
  }
  if (options_.direction != search_direction::target_to_source) {
    find_forward(transform, memory.sources);
    out.reserve(static_cast<std::size_t>(source_.size()));
    for (std::int32_t s = 0; s < source_.size(); ++s)
      if (const auto t = partner_of(memory.sources, s); t >= 0) {
        const S distance = memory.sources.distances[static_cast<std::size_t>(s)];
        if (distance <= limit) out.push_back({t, s, distance});
      }
  }
  if (options_.direction != search_direction::source_to_target) {
    find_backward(transform, memory.targets, {});
    for (std::int32_t t = 0; t < target_.size(); ++t)
      if (const auto s = partner_of(memory.targets, t); s >= 0) pair_of(t, s);
    const auto place = [](const auto& p) { return std::pair{p.source, p.target}; };
    std::ranges::sort(out, {}, place);
    const auto rest = std::ranges::unique(out, {}, place);
    out.erase(rest.begin(), rest.end());
  }
  if (options_.one_to_one != sides::none || options_.fraction < 1)
    select_correspondences(out, options_);
}

#define CILANTRO_INSTANTIATE(S, D) template class nearest_neighbor_engine<S, D>;
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
