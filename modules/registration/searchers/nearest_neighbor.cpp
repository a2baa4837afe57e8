// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
#include "registration/kernels/track.hpp"
module cilantro.registration;

namespace cilantro {
namespace {

/// Queries that one thread looks at at a time.
constexpr index_t block_size = 512;

/// How queries move: linear · (q − origin) + translation. An inverse has an origin, so that far
/// coordinates are near ones before they are rotated.
template <Scalar S, int D>
struct query_map {
  Eigen::Matrix<S, D, D> linear;
  point_vector<S, D> origin, translation;

  static query_map identity(index_t dimension) {
    return {Eigen::Matrix<S, D, D>::Identity(dimension, dimension),
            point_vector<S, D>::Zero(dimension), point_vector<S, D>::Zero(dimension)};
  }
  static query_map forward(const affine_parts<S, D>& t) {
    return {t.linear, point_vector<S, D>::Zero(t.translation.size()), t.translation};
  }
  /// Precondition: the map is rigid.
  static query_map backward(const affine_parts<S, D>& t) {
    return {t.linear.transpose(), t.translation, point_vector<S, D>::Zero(t.translation.size())};
  }
  [[nodiscard]] point_vector<S, D> operator()(const auto& q) const {
    return linear * (q - origin) + translation;
  }
};

/// A little farther than asked, so that also queries without a partner may move.
template <Scalar S>
S reach_of(S max_distance) {
  return max_distance * S(1.5);
}
template <Scalar S>
S slack_of(index_t dimension) {
  return S(16 + 2 * dimension) * std::numeric_limits<S>::epsilon();
}

/// Finds for each query, at `map(queries[q])`, the nearest of `points`, which are those of `tree`;
/// unless what is known from an earlier call tells that nothing can have changed, for the reason
/// that registration/kernels/track.cpp gives.
template <Scalar S, int D>
void track_one_by_one(const kd_tree<S, D>& tree, points_view<S, D> points,
                      points_view<S, D> queries, const query_map<S, D>& map, S max_distance,
                      tracked_queries<S>& known, std::span<const char> is_wanted, int threads) {
  const index_t dimension = points.dimension();
  const auto n = static_cast<std::size_t>(queries.size());
  known.places.resize(n * static_cast<std::size_t>(dimension));
  known.nearest.resize(n);
  known.others.resize(n);
  known.distances.resize(n);
  const S reach = reach_of(max_distance), slack = slack_of<S>(dimension);

  parallel_blocks(
      queries.size(), block_size, {.threads = threads}, [&](index_t, index_t begin, index_t end) {
        for (index_t q = begin; q < end; ++q) {
          const auto at = static_cast<std::size_t>(q);
          if (!is_wanted.empty() && !is_wanted[at]) {
            // What was known of it stays true; before the first search nothing is.
            if (!known.is_known) known.others[at] = -1;
            continue;
          }
          const point_vector<S, D> p = map(queries[q]);
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

/// By all threads, since memory that is new costs more than what is written to it.
template <class T>
void fill(buffer<T>& all, T value, int threads) {
  parallel_blocks(std::ssize(all), 1 << 16, {.threads = threads},
                  [&](index_t, index_t begin, index_t end) {
                    std::fill(all.begin() + begin, all.begin() + end, value);
                  });
}

template <Scalar S, int D>
detail::track_kernel<S>& track_kernel() {
  return *detail::for_target(static_cast<int>(current_vector_target()),
                             []<detail::kernel_target V> { return detail::track_in<V, S, D>(); });
}

/// The same, a block of the queries' own tree at a time. `at` is where the queries are, as that
/// tree has them.
template <Scalar S, int D>
void track_in_blocks(const kd_tree<S, D>& tree, points_view<S, D> points,
                     const kd_tree<S, D>& queries, const S* at, const query_map<S, D>& map,
                     S max_distance, tracked_queries<S>& known, std::span<const char> is_wanted,
                     int threads) {
  constexpr index_t width = 16;
  const auto& nodes = queries.nodes();
  const index_t blocks = nodes.blocks();
  const auto slots = static_cast<std::size_t>(blocks * width);
  known.places.resize(slots * std::size_t(D));
  known.others.resize(slots);
  known.held.resize(slots);
  known.distances.resize(queries.size());
  if (!known.is_known) {
    // Those that are not finite are in no block.
    known.nearest.resize(known.distances.size());
    fill(known.nearest, -1, threads);
    fill(known.places, S(0), threads);
  }
  const detail::track_search<S> search{detail::blocks_of<S>(tree.nodes()),
                                       points.data(),
                                       points.stride(),
                                       map.linear.data(),
                                       map.origin.data(),
                                       map.translation.data(),
                                       max_distance,
                                       reach_of(max_distance),
                                       slack_of<S>(D),
                                       known.is_known};
  const auto& track = track_kernel<S, D>();
  parallel_blocks(
      blocks, block_size / width, {.threads = threads}, [&](index_t, index_t begin, index_t end) {
        for (index_t b = begin; b < end; ++b) {
          const std::int32_t* const names = nodes.indices.data() + b * width;
          std::array<S, width> distances;
          unsigned wanted = 0;
          for (index_t i = 0; i < width; ++i)
            if (names[i] >= 0 && (is_wanted.empty() || is_wanted[names[i]])) wanted |= 1u << i;
          track(search,
                {at + b * width * D, wanted, known.places.data() + b * width * D,
                 known.held.data() + b * width, known.others.data() + b * width, distances.data()});
          for (index_t i = 0; i < width; ++i) {
            if ((wanted >> i & 1) == 0) continue;
            const auto q = static_cast<std::size_t>(names[i]);
            known.nearest[q] = known.held[b * width + i];
            known.distances[q] = distances[i];
          }
        }
      });
  known.is_known = true;
}

template <Scalar S, int D>
void track(const kd_tree<S, D>& tree, points_view<S, D> points,
           const std::optional<kd_tree<S, D>>& queries_tree, points_view<S, D> queries,
           const query_map<S, D>& map, S max_distance, tracked_queries<S>& known,
           std::span<const char> is_wanted, int threads) {
  if constexpr (D == dynamic)
    track_one_by_one(tree, points, queries, map, max_distance, known, is_wanted, threads);
  else
    track_in_blocks(tree, points, *queries_tree, queries_tree->nodes().block(0), map, max_distance,
                    known, is_wanted, threads);
}

/// The same of queries that have been moved since the tree of them was made.
template <Scalar S, int D>
void track_moved(const kd_tree<S, D>& tree, points_view<S, D> points,
                 const std::optional<kd_tree<S, D>>& queries_tree, points_view<S, D> moved,
                 S max_distance, tracked_queries<S>& known, int threads) {
  const auto stay = query_map<S, D>::identity(points.dimension());
  if constexpr (D == dynamic) {
    track_one_by_one(tree, points, moved, stay, max_distance, known, {}, threads);
  } else {
    constexpr index_t width = 16;
    const auto& nodes = queries_tree->nodes();
    buffer<S> at(nodes.blocks() * width * D);
    parallel_for(nodes.blocks(), {.threads = threads}, [&](index_t b) {
      for (index_t i = 0; i < width; ++i) {
        const index_t q = nodes.indices[b * width + i];
        for (index_t d = 0; d < D; ++d)
          at[(b * D + d) * width + i] = q >= 0 ? moved[q][d] : std::numeric_limits<S>::quiet_NaN();
      }
    });
    track_in_blocks(tree, points, *queries_tree, at.data(), stay, max_distance, known, {}, threads);
  }
}

/// The pairs of what was found within the limit, in the order of the queries. `out` may hold what
/// it held before, which is overwritten: clearing it would clear its memory again by one thread.
template <Scalar S>
void keep_within(S limit, const tracked_queries<S>& found, int threads, correspondences<S>& out) {
  constexpr index_t block = 1 << 13;
  const auto n = std::ssize(found.nearest);
  const auto is_pair = [&](index_t q) {
    return (found.nearest[q] >= 0) & (found.distances[q] <= limit);
  };
  std::vector<index_t> first(static_cast<std::size_t>((n + block - 1) / block) + 1);
  parallel_blocks(n, block, {.threads = threads}, [&](index_t b, index_t begin, index_t end) {
    index_t count = 0;
    for (index_t q = begin; q < end; ++q) count += is_pair(q);
    first[b + 1] = count;
  });
  std::partial_sum(first.begin(), first.end(), first.begin());
  out.reserve(found.nearest.size());
  out.resize(first.back());
  parallel_blocks(n, block, {.threads = threads}, [&](index_t b, index_t begin, index_t end) {
    index_t next = first[b];
    for (index_t q = begin; q < end; ++q)
      if (is_pair(q))
        out[next++] = {static_cast<std::int32_t>(q), found.nearest[q], found.distances[q]};
  });
}

}  // namespace

template <Scalar S, int D>
nearest_neighbor_engine<S, D>::nearest_neighbor_engine(points_view<S, D> source,
                                                       points_view<S, D> target,
                                                       const correspondence_options& options,
                                                       const task_monitor& monitor,
                                                       const nearest_neighbor_engine* same_target)
    : target_{target}, source_{source}, options_{options} {
  expect_valid(options);
  expects(target.empty() || source.empty() || target.dimension() == source.dimension(),
          "nearest_neighbor_searcher: target and source must have the same dimension");
  if (target.empty() || source.empty()) return;
  const kd_tree_options how{.threads = options.threads, .monitor = in_passes(monitor, 2)};
  if (same_target && same_target->target_tree_)
    target_tree_ = same_target->target_tree_;
  else if (D != dynamic || options.reciprocal ||
           options.direction != search_direction::target_to_source)
    target_tree_.emplace(target, how);
  if (D != dynamic || options.reciprocal || options.direction != search_direction::source_to_target)
    source_tree_.emplace(source, how);
  if (monitor.progress) monitor.progress(1);
}

template <Scalar S, int D>
void nearest_neighbor_engine<S, D>::find_forward(const source_motion& motion,
                                                 tracked_queries<S>& tracked) const {
  const S limit = static_cast<S>(options_.max_distance);
  if (motion.transform)
    track<S, D>(*target_tree_, target_, source_tree_, source_,
                query_map<S, D>::forward(*motion.transform), limit, tracked, {}, options_.threads);
  else
    track_moved<S, D>(*target_tree_, target_, source_tree_, motion.moved, limit, tracked,
                      options_.threads);
}

template <Scalar S, int D>
void nearest_neighbor_engine<S, D>::find_backward(const source_motion& motion,
                                                  tracked_queries<S>& tracked,
                                                  std::span<const char> is_wanted) const {
  const S limit = static_cast<S>(options_.max_distance);
  if (motion.is_rigid) {
    // Distances are the same on the other side, where the tree is. Rounding on that side must not
    // lose what is just within the limit.
    return track<S, D>(*source_tree_, source_, target_tree_, target_,
                       query_map<S, D>::backward(*motion.transform), limit * S(1.001), tracked,
                       is_wanted, options_.threads);
  }
  point_matrix<S, D> by_transform;
  points_view<S, D> moved = motion.moved;
  if (motion.transform) {
    by_transform.resize(source_.dimension(), source_.size());
    parallel_for(source_.size(), {.threads = options_.threads},
                 [&](index_t s) { by_transform.col(s) = (*motion.transform)(source_[s]); });
    moved = as_points(by_transform);
  }
  tracked.is_known = false;
  const kd_tree<S, D> tree{moved, {.threads = options_.threads}};
  track<S, D>(tree, moved, target_tree_, target_, query_map<S, D>::identity(source_.dimension()),
              limit, tracked, is_wanted, options_.threads);
  // It is known of points that are gone, and in other coordinates than a rigid search asks in.
  tracked.is_known = false;
}

template <Scalar S, int D>
void nearest_neighbor_engine<S, D>::find(const affine_parts<S, D>& transform, bool is_rigid,
                                         nearest_neighbor_memory<S>& memory,
                                         correspondences<S>& out) const {
  find(source_motion{&transform, is_rigid, {}}, memory, out);
}

template <Scalar S, int D>
void nearest_neighbor_engine<S, D>::find(points_view<S, D> moved,
                                         nearest_neighbor_memory<S>& memory,
                                         correspondences<S>& out) const {
  find(source_motion{nullptr, false, moved}, memory, out);
}

template <Scalar S, int D>
void nearest_neighbor_engine<S, D>::find(const source_motion& motion,
                                         nearest_neighbor_memory<S>& memory,
                                         correspondences<S>& out) const {
  if (target_.empty() || source_.empty() ||
      options_.direction == search_direction::target_to_source || options_.reciprocal)
    out.clear();
  if (target_.empty() || source_.empty()) return;
  const S limit = static_cast<S>(options_.max_distance);
  const auto pair_of = [&](std::int32_t t, std::int32_t s) {
    const S distance = (motion.place_of(source_, s) - target_[t]).norm();
    if (distance <= limit) out.push_back({s, t, distance});
  };
  const auto partner_of = [](const tracked_queries<S>& found, index_t i) {
    return found.nearest[i];
  };

  if (options_.reciprocal) {
    find_forward(motion, memory.sources);
    memory.is_wanted.assign(static_cast<std::size_t>(target_.size()), 0);
    for (const std::int32_t t : memory.sources.nearest)
      if (t >= 0) memory.is_wanted[t] = 1;
    find_backward(motion, memory.targets, memory.is_wanted);
    for (std::int32_t s = 0; s < source_.size(); ++s)
      if (const auto t = partner_of(memory.sources, s);
          t >= 0 && partner_of(memory.targets, t) == s)
        pair_of(t, s);
    return select_correspondences(out, options_);
  }
  if (options_.direction != search_direction::target_to_source) {
    find_forward(motion, memory.sources);
    keep_within(limit, memory.sources, options_.threads, out);
  }
  if (options_.direction != search_direction::source_to_target) {
    find_backward(motion, memory.targets, {});
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

#define CILANTRO_INSTANTIATE(S, D) template class detail::nearest_neighbor_engine<S, D>;
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
