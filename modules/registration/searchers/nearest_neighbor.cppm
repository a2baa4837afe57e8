// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
export module cilantro.registration:nearest_neighbor;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :correspondence;

namespace cilantro {

/// What a search has found for each query, and until when that holds. In two and three dimensions
/// the first three are in the order of the queries' own tree, block by block.
template <Scalar S>
struct tracked_queries {
  bool is_known = false;
  buffer<S> places;           ///< Where each query was when it was last searched for.
  buffer<S> others;           ///< From there to any point but the nearest it is at least that far.
  buffer<std::int32_t> held;  ///< The nearest then; −1: none.
  buffer<std::int32_t> nearest;  ///< By the index of the query; −1: none.
  buffer<S> distances;           ///< To the nearest, now; by the index of the query.
};

/// What a `nearest_neighbor_searcher` remembers between the searches of a loop. Belongs to the
/// caller; one that another searcher has used starts afresh.
export template <Scalar S>
struct nearest_neighbor_memory {
  std::shared_ptr<const void> owner;
  tracked_queries<S> sources, targets;
  std::vector<char> is_wanted;  ///< Of the targets, where not all are asked.
};

/// Compiled in the library.
template <Scalar S, int D>
class nearest_neighbor_engine {
 public:
  nearest_neighbor_engine(points_view<S, D> source, points_view<S, D> target,
                          const correspondence_options& options, const task_monitor& monitor);
  [[nodiscard]] int threads() const { return options_.threads; }
  /// `is_rigid` is what the type of the transform says.
  void find(const affine_parts<S, D>& transform, bool is_rigid, nearest_neighbor_memory<S>& memory,
            correspondences<S>& out) const;
  /// With the source where something else has moved it.
  void find(points_view<S, D> moved, nearest_neighbor_memory<S>& memory,
            correspondences<S>& out) const;

 private:
  /// How the source is moved: by a transform, or point by point already.
  struct source_motion {
    const affine_parts<S, D>* transform;
    bool is_rigid;
    points_view<S, D> moved;

    [[nodiscard]] point_vector<S, D> place_of(points_view<S, D> source, index_t s) const {
      return transform ? (*transform)(source[s]) : point_vector<S, D>{moved[s]};
    }
  };

  void find(const source_motion& motion, nearest_neighbor_memory<S>& memory,
            correspondences<S>& out) const;
  void find_forward(const source_motion& motion, tracked_queries<S>& tracked) const;
  void find_backward(const source_motion& motion, tracked_queries<S>& tracked,
                     std::span<const char> is_wanted) const;

  points_view<S, D> target_, source_;
  correspondence_options options_;
  std::optional<kd_tree<S, D>> target_tree_, source_tree_;  ///< Both, where queries go by blocks.
};

/// For every source point the nearest target point, or the other way round, or both; which pairs
/// stay is said by `correspondence_options`. Works in any dimension.
///
/// Trees are built once. With a memory, a query that has moved by less than the gap between its
/// nearest and its second nearest point keeps its neighbour without a search: the result is the
/// same. Only a search from target to source under a map that is not rigid needs a new tree each
/// time; of a field of transforms, each point is moved once. Views target and source; copies share
/// their trees.
export template <Scalar S, int D>
class nearest_neighbor_searcher {
 public:
  using memory = nearest_neighbor_memory<S>;

  /// Throws `invalid_input` for points of different dimension, or options that make no sense;
  /// `cancelled`. O((M + N) log (M + N)).
  template <BorrowedPoints T, BorrowedPoints P>
  nearest_neighbor_searcher(P&& source, T&& target, const correspondence_options& options = {},
                            const task_monitor& monitor = {})
      : source_{as_points(source)},
        engine_{std::make_shared<const engine>(source_, as_points(target), options, monitor)} {
    expect_same_origin(source, target, "nearest_neighbor_searcher");
  }

  /// As `CorrespondenceSearcher` says; distances are Euclidean. Throws `invalid_input` for a map of
  /// another dimension or number of points. O(N log M).
  template <PointMap<D> M>
    requires std::same_as<typename M::Scalar, S>
  void find(const M& map, correspondences<S>& out) const {
    memory fresh;
    find(map, fresh, out);
  }
  template <PointMap<D> M>
    requires std::same_as<typename M::Scalar, S>
  void find(const M& map, memory& known, correspondences<S>& out) const {
    expect_moves(map, source_, "nearest_neighbor_searcher");
    if (known.owner != engine_) known = {engine_, {}, {}, {}};
    if constexpr (AffineMap<M>) {
      engine_->find(affine_parts<S, C>{map}, RigidMap<M>, known, out);
    } else {
      const auto moved = moved_points(map, source_, {.threads = engine_->threads()});
      engine_->find(points_view<S, C>{points_in(moved)}, known, out);
    }
  }

 private:
  static constexpr int C = closed_dimension<D>;
  using engine = nearest_neighbor_engine<S, C>;
  points_view<S, D> source_;
  std::shared_ptr<const engine> engine_;
};
export template <PointsSource T, PointsSource P>
nearest_neighbor_searcher(T&&, P&&, correspondence_options = {}, task_monitor = {})
    -> nearest_neighbor_searcher<scalar_of<T>, dimension_of<T>>;

#define CILANTRO_COMPILED_ELSEWHERE(S, D) extern template class nearest_neighbor_engine<S, D>;
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
