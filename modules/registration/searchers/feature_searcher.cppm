// SPDX-License-Identifier: MIT
export module cilantro.registration:feature_searcher;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import :correspondence;
import :feature_space;

namespace cilantro {

/// Judges a pair by the distance at which it was found.
export struct same_distance {
  template <Scalar S>
  S operator()(S distance) const {
    return distance;
  }
};

/// Pairs points that are nearest in a `FeatureSpace`, with the same options as
/// `nearest_neighbor_searcher`.
///
/// A judge can decide which pairs are accepted: a second `FeatureSpace` of the same points, or a
/// `PairWeight` of source index, target index and distance. It replaces the distance of each pair,
/// and `max_distance`, `one_to_one` and `fraction` apply to that. The target's tree is built once;
/// the source's, for the other direction, is built in every search, since features may move in any
/// way. Keeps copies of space and judge.
export template <class Space, class Judge = same_distance>
class feature_searcher {
 public:
  using scalar = scalar_of<decltype(std::declval<const Space&>().target())>;
  static constexpr int feature_dimension =
      dimension_of<decltype(std::declval<const Space&>().target())>;

  /// Throws `invalid_input` for options that make no sense, for features of dimension 0, and for a
  /// judge of other points.
  explicit feature_searcher(Space space, const correspondence_options& options = {},
                            Judge judge = {})
      : space_{std::move(space)},
        options_{options},
        judge_{std::move(judge)},
        tree_{space_.target(), {.threads = options.threads}} {
    expect_valid(options);
    const index_t sources = space_.source_size(), targets = space_.target().size();
    if constexpr (requires { judge_.source_size(); })
      expects(index_t(judge_.source_size()) == sources && judge_.target().size() == targets,
              "feature_searcher: the judge must be of the same source and target");
    else
      expect_sizes(judge_, sources, targets, "feature_searcher");
  }

  /// As `CorrespondenceSearcher` says. O(N log M) in low dimension.
  template <class T>
    requires FeatureSpace<Space, T> && (PairWeight<Judge, scalar> || FeatureSpace<Judge, T>)
  void find(const T& transform, correspondences<scalar>& out) const {
    out.clear();
    const auto target = space_.target();
    const index_t rows = target.dimension(), n = space_.source_size();
    if (target.empty() || n == 0) return;
    const auto move = space_.moved_by(transform);

    const bool forward =
        options_.reciprocal || options_.direction != search_direction::target_to_source;
    const bool backward =
        options_.reciprocal || options_.direction != search_direction::source_to_target;
    if (forward) {
      out.resize(n);
      parallel_blocks(n, default_block_size, how(), [&](index_t, index_t begin, index_t end) {
        point_vector<scalar, feature_dimension> feature(rows);
        for (index_t s = begin; s < end; ++s) {
          move(s, feature.data());
          const auto [t, distance] = tree_.nearest_two(feature)[0];
          out[s] = {static_cast<std::int32_t>(s), static_cast<std::int32_t>(t), distance};
        }
      });
    }
    if (backward) {
      point_matrix<scalar, feature_dimension> moved(rows, n);
      parallel_for(n, how(), [&](index_t i) { move(i, moved.data() + i * rows); });
      const tree_type tree{moved, {.threads = options_.threads}};
      correspondences<scalar> back(target.size());
      parallel_for(target.size(), how(), [&](index_t t) {
        const auto [s, distance] = tree.nearest_two(target[t])[0];
        back[t] = {static_cast<std::int32_t>(s), static_cast<std::int32_t>(t), distance};
      });
      merge(out, back, forward);
    }
    std::erase_if(out, [](const auto& pair) { return pair.source < 0 || pair.target < 0; });
    judge(transform, out);
    select_correspondences(out, options_);
  }

 private:
  using tree_type = kd_tree<scalar, feature_dimension>;

  [[nodiscard]] execution how() const { return {.threads = options_.threads}; }

  /// Keeps the pairs that both directions have found if they must be reciprocal, otherwise those of
  /// either.
  void merge(correspondences<scalar>& found, const correspondences<scalar>& back,
             bool have_both) const {
    const auto place = [](const auto& p) { return std::pair{p.source, p.target}; };
    found.insert(found.end(), back.begin(), back.end());
    std::ranges::sort(found, {}, place);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      const bool twice = i + 1 < found.size() && place(found[i]) == place(found[i + 1]);
      if (twice || !(options_.reciprocal && have_both)) found[kept++] = found[i];
      i += twice;
    }
    found.resize(kept);
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
                          auto& pair = pairs[i];
                          move(pair.source, feature.data());
                          pair.distance = (target[pair.target] - feature).norm();
                        }
                      });
    } else {
      parallel_for(std::ssize(pairs), how(), [&](index_t i) {
        auto& pair = pairs[i];
        pair.distance = static_cast<scalar>(
            evaluate_pair<scalar>(judge_, pair.source, pair.target, pair.distance));
      });
    }
  }

  Space space_;
  correspondence_options options_;
  Judge judge_;
  tree_type tree_;
};

}  // namespace cilantro
