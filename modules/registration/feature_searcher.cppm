// SPDX-License-Identifier: MIT
export module cilantro.registration:feature_searcher;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :correspondence;
import :feature_space;

namespace cilantro {

/// Accepts a pair by the distance that found it.
export struct same_distance {
  template <Scalar S>
  S operator()(S distance) const {
    return distance;
  }
};

/// The nearest points in a `FeatureSpace`, under the same options as `nearest_neighbor_searcher`.
///
/// Another judge may decide which pairs are accepted: a second `FeatureSpace` of the same points,
/// or a `PairEvaluator` of target index, source index and distance. Pairs then have the distance
/// that it says, and `max_distance` and all that follows apply to that.
/// The target's tree is built once; the source's, for the other direction, in every search, since
/// features may move in any way. Keeps a copy of space and judge.
export template <class Space, class Judge = same_distance>
class feature_searcher {
 public:
  using scalar = scalar_of<decltype(std::declval<const Space&>().target())>;
  static constexpr int feature_dimension =
      dimension_of<decltype(std::declval<const Space&>().target())>;

  /// Throws `invalid_input` for options that make no sense, or features without a dimension.
  explicit feature_searcher(Space space, const correspondence_options& options = {},
                            Judge judge = {})
      : space_{std::move(space)},
        options_{options},
        judge_{std::move(judge)},
        tree_{space_.target(), {.threads = options.threads}} {
    expect_valid(options);
  }

  /// As `CorrespondenceSearcher` says. O(N log M) in low dimension.
  template <class T>
    requires FeatureSpace<Space, T> && (PairEvaluator<Judge, scalar> || FeatureSpace<Judge, T>)
  void find(const T& transform, correspondences<scalar>& out) const {
    out.clear();
    const auto target = space_.target();
    const index_t rows = target.dimension(), n = space_.source_size();
    if (target.empty() || n == 0) return;
    point_matrix<scalar, feature_dimension> moved(rows, n);
    const auto move = space_.moved_by(transform);
    parallel_for(n, how(), [&](index_t i) { move(i, moved.data() + i * rows); });

    const bool forward =
        options_.reciprocal || options_.direction != search_direction::target_to_source;
    const bool backward =
        options_.reciprocal || options_.direction != search_direction::source_to_target;
    correspondences<scalar> found, back;
    if (forward) found = nearest_of(tree_, points_in(moved), false);
    if (backward) back = nearest_of(tree_type{moved, {.threads = options_.threads}}, target, true);
    merge(found, back, forward && backward);
    judge(transform, found);
    select_correspondences(found, options_);
    out = std::move(found);
  }

 private:
  using tree_type = kd_tree<scalar, feature_dimension>;
  using view_type = points_view<scalar, feature_dimension>;

  [[nodiscard]] execution how() const { return {.threads = options_.threads}; }

  /// Without a limit on the distance, which is the judge's to apply.
  correspondences<scalar> nearest_of(const tree_type& tree, view_type queries,
                                     bool queries_are_targets) const {
    std::vector<std::array<neighbor<scalar>, 2>> nearest(static_cast<std::size_t>(queries.size()));
    parallel_for(queries.size(), how(), [&](index_t q) {
      nearest[static_cast<std::size_t>(q)] = tree.nearest_two(queries[q]);
    });
    correspondences<scalar> pairs;
    for (std::int32_t q = 0; q < queries.size(); ++q) {
      const auto [index, distance] = nearest[static_cast<std::size_t>(q)][0];
      const auto i = static_cast<std::int32_t>(index);
      if (i < 0) continue;
      if (queries_are_targets)
        pairs.push_back({q, i, distance});
      else
        pairs.push_back({i, q, distance});
    }
    return pairs;
  }

  /// What both directions say if pairs are to be reciprocal, otherwise what either of them says.
  void merge(correspondences<scalar>& found, const correspondences<scalar>& back,
             bool in_both) const {
    const auto place = [](const auto& p) { return std::pair{p.source, p.target}; };
    found.insert(found.end(), back.begin(), back.end());
    std::ranges::sort(found, {}, place);
    correspondences<scalar> merged;
    for (std::size_t i = 0; i < found.size(); ++i) {
      const bool twice = i + 1 < found.size() && place(found[i]) == place(found[i + 1]);
      if (twice || !(options_.reciprocal && in_both)) merged.push_back(found[i]);
      i += twice;
    }
    found = std::move(merged);
  }

  template <class T>
  void judge(const T& transform, correspondences<scalar>& pairs) const {
    if constexpr (FeatureSpace<Judge, T>) {
      const auto target = judge_.target();
      const auto move = judge_.moved_by(transform);
      parallel_blocks(std::ssize(pairs), default_block_size, how(),
                      [&](index_t, index_t begin, index_t end) {
                        Eigen::Matrix<scalar, dynamic, 1> feature(target.dimension());
                        for (index_t i = begin; i < end; ++i) {
                          auto& pair = pairs[static_cast<std::size_t>(i)];
                          move(pair.source, feature.data());
                          pair.distance = (target[pair.target] - feature).norm();
                        }
                      });
    } else {
      parallel_for(std::ssize(pairs), how(), [&](index_t i) {
        auto& pair = pairs[static_cast<std::size_t>(i)];
        pair.distance = static_cast<scalar>(
            evaluate_pair<scalar>(judge_, pair.target, pair.source, pair.distance));
      });
    }
  }

  Space space_;
  correspondence_options options_;
  Judge judge_;
  tree_type tree_;
};

}  // namespace cilantro
