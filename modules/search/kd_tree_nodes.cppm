// SPDX-License-Identifier: MIT
//
// What a kd-tree consists of, and how it is traversed. Internal.
export module cilantro.search:kd_tree_nodes;

import cilantro.standard;
import cilantro.core;
import :metric;
import :neighborhood;

namespace cilantro {

/// Options of `kd_tree`.
export struct kd_tree_options {
  /// The most points in a leaf. Points are kept in blocks of 16, and the smallest leaf has one or
  /// two blocks, so that values below 32 change nothing. Affects speed only.
  int max_leaf_size = 32;
  int threads = 0;  ///< For building the tree.
  task_monitor monitor = {};
};

/// How many points are stored and compared together: as many as the widest vectors hold.
inline constexpr index_t points_per_block = 16;

/// A balanced tree over full blocks of points: node k of a level has the blocks `begin(level, k)`
/// to `begin(level, k + 1)` in tree order, and the two nodes 2k and 2k + 1 of the next level as its
/// halves. All leaves are on the last level. In two and three dimensions there are boxes, too, by
/// which blocks of queries are answered together; see search/kernels/block_search.hpp.
template <Scalar S, int D>
struct kd_tree_nodes {
  /// Where a node is cut: its first half ends at `low` along `axis`, its second begins at `high`.
  struct cut {
    S low, high;
    std::int32_t axis;
  };
  static constexpr bool has_boxes = D == 2 || D == 3;

  /// Throws `invalid_input` for points of dimension 0, too many points, or a `max_leaf_size` below
  /// 1; `cancelled`.
  kd_tree_nodes(points_view<S, D> points, const kd_tree_options& options);

  [[nodiscard]] index_t blocks() const {
    return (searchable + points_per_block - 1) / points_per_block;
  }
  [[nodiscard]] index_t begin(int level, index_t k) const { return (k * blocks()) >> level; }
  [[nodiscard]] const cut& at(int level, index_t k) const {
    return cuts[(std::size_t{1} << level) - 1 + static_cast<std::size_t>(k)];
  }
  /// All first coordinates of a block's points, then all second ones, …
  [[nodiscard]] const S* block(index_t b) const {
    return coordinates.data() + b * dimension * points_per_block;
  }
  [[nodiscard]] std::size_t memory() const {
    return sizeof *this +
           (coordinates.capacity() + boxes.capacity() + children.capacity()) * sizeof(S) +
           indices.capacity() * sizeof(std::int32_t) + cuts.capacity() * sizeof(cut);
  }

  index_t size = 0;  ///< The number of all points, including those that are not searchable.
  index_t searchable = 0;
  index_t dimension = 0;
  S largest = 0;                 ///< The largest magnitude of a searchable coordinate.
  int levels = 0;                ///< Of cuts, above the leaves.
  buffer<S> coordinates;         ///< By `block`; NaN after the last point.
  buffer<std::int32_t> indices;  ///< The user's indices; −1 after the last.
  buffer<S> boxes, children;     ///< As `block_tree` says, if `has_boxes`.
  std::vector<cut> cuts;
  point_vector<S, D> low, high;  ///< The box around all points.
};

/// One search: passes every point that may be among the nearest to `result`.
///
/// The bound of a node is the metric's sum between the query and the node's box, kept up to date
/// axis by axis (Arya & Mount 1993). It is summed in another order than the distance to a point
/// is; `slack` keeps that from dropping a node whose points tie with the worst so far.
template <Scalar S, int D, CoordinateMetric<S> M, class Result>
class kd_tree_search {
 public:
  kd_tree_search(const kd_tree_nodes<S, D>& tree, const M& metric, const S* query, Result& result)
      : tree_{tree}, metric_{metric}, query_{query}, result_{result} {}

  void run() {
    if constexpr (needs_box) {
      low_ = tree_.low;
      high_ = tree_.high;
      S bound[images] = {};
      for (int image = 0; image < images; ++image) {
        terms_[image].resize(dimension());
        for (index_t d = 0; d < dimension(); ++d)
          bound[image] = combine_terms(metric_, bound[image], terms_[image][d] = term(image, d));
      }
      walk_boxes(0, 0, bound);
    } else {
      S bound = 0;
      terms_[0].resize(dimension());
      for (index_t d = 0; d < dimension(); ++d) {
        const S v = query_[d];
        const S outside = v < tree_.low[d] ? v - tree_.low[d] : std::max(v - tree_.high[d], S(0));
        bound = combine_terms(metric_, bound, terms_[0][d] = metric_.term(outside, d));
      }
      walk(0, 0, bound);
    }
  }

 private:
  static constexpr bool has_term_to =
      requires(const M& m, S v, index_t axis) { m.term_to(v, v, v, axis); };
  static constexpr bool needs_box = has_term_to || is_antipodal<M>;
  /// An antipodal metric searches from two places at once.
  static constexpr int images = is_antipodal<M> ? 2 : 1;

  [[nodiscard]] index_t dimension() const { return D == dynamic ? tree_.dimension : D; }

  void scan(index_t leaf) {
    const index_t end = tree_.begin(tree_.levels, leaf + 1);
    for (index_t b = tree_.begin(tree_.levels, leaf); b < end; ++b) {
      S sums[points_per_block];
      sum_all(tree_.block(b), sums);
      const index_t first = b * points_per_block;
      const index_t count = std::min(points_per_block, tree_.searchable - first);
      for (index_t i = 0; i < count; ++i) result_.add(sums[i], tree_.indices[first + i]);
    }
  }

  /// `metric_sum` for all points of a block: in the same order, hence with the same bits.
  void sum_all(const S* block, S (&sums)[points_per_block]) const {
    add_terms(block, sums, [](S a, S b) { return a - b; });
    if constexpr (is_antipodal<M>) {
      S others[points_per_block];
      add_terms(block, others, [](S a, S b) { return a + b; });
      for (index_t i = 0; i < points_per_block; ++i) sums[i] = std::min(sums[i], others[i]);
    }
  }
  template <class F>
  void add_terms(const S* block, S (&sums)[points_per_block], F difference) const {
    for (S& sum : sums) sum = 0;
    for (index_t d = 0; d < dimension(); ++d, block += points_per_block)
      for (index_t i = 0; i < points_per_block; ++i)
        sums[i] = combine_terms(metric_, sums[i], metric_.term(difference(query_[d], block[i]), d));
  }

  /// The bound of a box whose term along one axis was `before` and is `after`.
  [[nodiscard]] S replace(S bound, S before, S after) const {
    if constexpr (requires { metric_.combine(bound, after); })
      return metric_.combine(bound, after);
    else
      return bound - before + after;
  }
  [[nodiscard]] bool is_out_of_reach(S bound) const {
    const S slack = 1 + S(256 + 2 * dimension()) * std::numeric_limits<S>::epsilon();
    return bound > result_.worst() * slack + std::numeric_limits<S>::min();
  }

  void walk(int level, index_t k, S bound) {
    if (level == tree_.levels) return scan(k);
    const auto& cut = tree_.at(level, k);
    const S value = query_[cut.axis];
    const bool second = value - cut.low > cut.high - value;
    walk(level + 1, 2 * k + second, bound);

    S& term = terms_[0][cut.axis];
    const S before = term;
    const S after = metric_.term(value - (second ? cut.low : cut.high), cut.axis);
    bound = replace(bound, before, after);
    if (is_out_of_reach(bound)) return;
    term = after;
    walk(level + 1, 2 * k + !second, bound);
    term = before;
  }

  /// The term between the query, or its negative, and the current box.
  [[nodiscard]] S term(int image, index_t d) const {
    const S value = image == 0 ? query_[d] : -query_[d];
    const S low = low_[d], high = high_[d];
    if (value >= low && value <= high) return 0;
    if constexpr (has_term_to)
      return metric_.term_to(value, low, high, d);
    else
      return metric_.term(value < low ? value - low : value - high, d);
  }

  void walk_boxes(int level, index_t k, const S (&bound)[images]) {
    if (level == tree_.levels) return scan(k);
    const auto& cut = tree_.at(level, k);
    const index_t d = cut.axis;
    const S low = low_[d], high = high_[d];
    S before[images], after[2][images], bounds[2][images], least[2];
    for (int side = 0; side < 2; ++side) {
      low_[d] = side == 0 ? low : cut.high;
      high_[d] = side == 0 ? cut.low : high;
      for (int image = 0; image < images; ++image) {
        before[image] = terms_[image][d];
        after[side][image] = term(image, d);
        bounds[side][image] = replace(bound[image], before[image], after[side][image]);
      }
      least[side] = bounds[side][0];
      if constexpr (images == 2) least[side] = std::min(least[side], bounds[side][1]);
    }
    const int first = least[1] < least[0];
    for (const int side : {first, 1 - first}) {
      if (is_out_of_reach(least[side])) continue;
      low_[d] = side == 0 ? low : cut.high;
      high_[d] = side == 0 ? cut.low : high;
      for (int image = 0; image < images; ++image) terms_[image][d] = after[side][image];
      walk_boxes(level + 1, 2 * k + side, bounds[side]);
    }
    low_[d] = low;
    high_[d] = high;
    for (int image = 0; image < images; ++image) terms_[image][d] = before[image];
  }

  const kd_tree_nodes<S, D>& tree_;
  const M& metric_;
  const S* query_;
  Result& result_;
  point_vector<S, D> terms_[images];  ///< What each axis adds to the bound.
  point_vector<S, D> low_, high_;     ///< The current box, where it is needed.
};

}  // namespace cilantro
