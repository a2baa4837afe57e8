// SPDX-License-Identifier: MIT
export module cilantro.registration:known_pairs;

import cilantro.standard;
import cilantro.core;
import :correspondence;

namespace cilantro {

/// Uses pairs that are known beforehand, from descriptors or markers. Their distances are
/// recomputed for every transform, and `max_distance`, `one_to_one` and `fraction` apply to these;
/// `direction` and `reciprocal` are ignored. Views target and source, which must outlive it.
export template <Scalar S, int D>
class known_pairs_searcher {
 public:
  /// Throws `invalid_input` for an index that is out of range, points of different dimension or
  /// origin, or options that make no sense.
  template <BorrowedPoints T, BorrowedPoints P>
  known_pairs_searcher(P&& source, T&& target, correspondences<S> pairs,
                       const correspondence_options& options = {})
      : target_{as_points(std::forward<T>(target))},
        source_{as_points(std::forward<P>(source))},
        pairs_{std::move(pairs)},
        options_{options} {
    expect_valid(options);
    expect_same_origin(source, target, "known_pairs_searcher");
    expects(pairs_.empty() || target_.dimension() == source_.dimension(),
            "known_pairs_searcher: target and source must have the same dimension");
    for (const auto& pair : pairs_)
      expects(0 <= pair.target && pair.target < target_.size() && 0 <= pair.source &&
                  pair.source < source_.size(),
              "known_pairs_searcher: the index of a pair is out of range");
  }

  /// As `CorrespondenceSearcher` says. O(pairs).
  template <PointMap<D> M>
    requires std::same_as<typename M::Scalar, S>
  void find(const M& map, correspondences<S>& out) const {
    expect_moves(map, source_, "known_pairs_searcher");
    out = pairs_;
    for (auto& pair : out)
      pair.distance =
          (moved_point(map, pair.source, source_[pair.source]) - target_[pair.target]).norm();
    select_correspondences(out, options_);
  }

 private:
  points_view<S, D> target_, source_;
  correspondences<S> pairs_;
  correspondence_options options_;
};
export template <PointsSource T, PointsSource P>
known_pairs_searcher(T&&, P&&, correspondences<scalar_of<T>>, correspondence_options = {})
    -> known_pairs_searcher<scalar_of<T>, dimension_of<T>>;

}  // namespace cilantro
