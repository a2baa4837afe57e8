// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
export module cilantro.registration:nearest_neighbor;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :correspondence;

namespace cilantro {

/// What a search has found for each query, and how far the query may move before it must be
/// searched again. In two and three dimensions, the first three arrays are in the order of the
/// queries' own tree, block by block.
template <Scalar S>
struct tracked_queries {
  bool is_known = false;
  buffer<S> places;  ///< Where each query was when it was last searched for.
  buffer<S> others;  ///< A lower bound of the distance from there to any point but the nearest.
  buffer<std::int32_t> held;     ///< The nearest point at that time; −1: none.
  buffer<std::int32_t> nearest;  ///< The nearest point by the index of the query; −1: none.
  buffer<S> distances;           ///< The current distance to it, by the index of the query.
};

/// What a `nearest_neighbor_searcher` remembers between the searches of a loop. The caller owns it;
/// a searcher discards what another one (its `owner`) has left. `sources` and `targets` are what is
/// known about the points of each set.
export template <Scalar S>
struct nearest_neighbor_memory {
  std::shared_ptr<const void> owner;
  tracked_queries<S> sources, targets;
  std::vector<char> is_wanted;  ///< Which targets are searched for, unless all are.
};

namespace detail {
/// What `nearest_neighbor_searcher` searches with, in a dimension that the library is compiled for.
export template <Scalar S, int D>
class nearest_neighbor_engine {
 public:
  /// `same_target`: another engine of this target, whose tree of it is shared.
  nearest_neighbor_engine(points_view<S, D> source, points_view<S, D> target,
                          const correspondence_options& options, const task_monitor& monitor,
                          const nearest_neighbor_engine* same_target = nullptr);
  /// As its options say.
  [[nodiscard]] int threads() const { return options_.threads; }
  /// `is_rigid`: whether the type of the transform is a rigid one.
  void find(const affine_parts<S, D>& transform, bool is_rigid, nearest_neighbor_memory<S>& memory,
            correspondences<S>& out) const;
  /// As above, with the source already moved.
  void find(points_view<S, D> moved, nearest_neighbor_memory<S>& memory,
            correspondences<S>& out) const;

 private:
  /// How the source is moved: by a transform, or already point by point.
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
  std::optional<kd_tree<S, D>> target_tree_,
      source_tree_;  ///< Both exist if queries are answered in blocks.
};
}  // namespace detail
using detail::nearest_neighbor_engine;

/// Pairs every source point with the nearest target point, or the other way round, or both;
/// `correspondence_options` decide which pairs are kept. Works in any dimension.
///
/// Trees are built once. With a memory, a query whose nearest neighbour cannot have changed, since
/// it has moved too little, is not searched again; the result is the same. Only searches from
/// target to source under a map that is not rigid need a new tree each time. Views target and
/// source, which must outlive it; copies share their trees.
export template <Scalar S, int D>
class nearest_neighbor_searcher {
 public:
  using memory = nearest_neighbor_memory<S>;

  /// Throws `invalid_input` for points of different dimension or origin, or options that make no
  /// sense; `cancelled`. O((M + N) log (M + N)).
  template <BorrowedPoints T, BorrowedPoints P>
  nearest_neighbor_searcher(P&& source, T&& target, const correspondence_options& options = {},
                            const task_monitor& monitor = {})
      : source_{as_points(source)},
        engine_{std::make_shared<const engine>(source_, as_points(target), options, monitor)} {
    expect_same_origin(source, target, "nearest_neighbor_searcher");
  }

  /// As `CorrespondenceSearcher` says; distances are Euclidean. Throws `invalid_input` if the map
  /// is for another dimension or number of points. O(N log M).
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

#define CILANTRO_COMPILED_ELSEWHERE(S, D) \
  extern template class detail::nearest_neighbor_engine<S, D>;
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
