// SPDX-License-Identifier: MIT
export module cilantro.registration:projective;

import cilantro.standard;
import cilantro.core;
import cilantro.geometry;
import :correspondence;
import :nearest_neighbor;

namespace cilantro {

/// Pairs each source point with the target point that the target's camera sees in the same pixel:
/// no tree and no search, for frames of a depth camera that has moved little. Searches from the
/// source to the target only; other directions, and reciprocal pairs, are refused.
/// Source: Blais & Levine 1995, "Registering multiview range data to create 3D computer objects".
export template <Scalar S>
class projective_searcher {
 public:
  /// `camera` has the pose from which the target was seen, in the target's coordinates. The target
  /// need not be organised. Views target and source, which must outlive it. Throws `invalid_input`
  /// for a camera or options that make no sense or are not supported. O(M) for building, O(N) for
  /// each search.
  template <BorrowedPoints T, BorrowedPoints P>
  projective_searcher(P&& source, T&& target, const pinhole_camera<S>& camera,
                      const correspondence_options& options = {})
      : target_{as_points(std::forward<T>(target))},
        source_{as_points(std::forward<P>(source))},
        camera_{camera},
        options_{options},
        seen_{project(target_, camera, {.threads = options.threads})} {
    expect_valid(options);
    expect_same_origin(source, target, "projective_searcher");
    expects(!options.reciprocal && options.direction == search_direction::source_to_target,
            "projective_searcher: pairs are found from the source to the target only");
  }

  /// As `CorrespondenceSearcher` says; distances are Euclidean, in space.
  template <PointMap<3> M>
    requires std::same_as<typename M::Scalar, S>
  void find(const M& map, correspondences<S>& out) const {
    const auto moved = moved_points(map, source_, {.threads = options_.threads});
    pair_moved(as_points(moved), out);
  }

 private:
  void pair_moved(points_view<S, 3> source, correspondences<S>& out) const;

  points_view<S, 3> target_, source_;
  pinhole_camera<S> camera_;
  correspondence_options options_;
  image<std::int32_t> seen_;
};
export template <PointsSource T, PointsSource P, Scalar S>
projective_searcher(T&&, P&&, pinhole_camera<S>, correspondence_options = {})
    -> projective_searcher<S>;

extern template class projective_searcher<float>;
extern template class projective_searcher<double>;

}  // namespace cilantro
